"""Several policies that learn side by side in one world, each from its own rows. Begin with `Committee`.

Who a row belongs to is told by an observation of the row itself, so that any subset of rows can be decided or valued.
Towards the collector, the loop and the keeper a committee is one learner; inside, every member is a learner as ever,
with its own network, settings and optimiser, and sees its own observations under its own names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TypeVar

import numpy as np
import torch

from racecraft.algorithms.ppo import Decision, PpoLearner, PpoLosses, StateDict
from racecraft.algorithms.rollout_batch import Experience
from racecraft.contract.world import Array, WorldSpec

Part = TypeVar("Part")

COUNTED = ("transitions", "minibatches")
"""Figures that are added up; all others are means, weighted by transitions."""


class Committee:
    """Learners by name.

    Args:
        spec: The world's promise: observations "name/…" for each member, and continuous actions as wide as the widest.
        members: The learners, in the order of the numbers that `whose` tells.
        whose: Name of the observation that holds the number of a row's member.
        allowed: What follows "name/" in the name of the observation that holds a member's mask; it may be absent.
    """

    def __init__(self, spec: WorldSpec, members: Mapping[str, PpoLearner], whose: str, allowed: str) -> None:
        self.spec, self.members = spec, dict(members)
        self._whose, self._allowed = whose, allowed
        self.device = next(iter(self.members.values())).device
        self._width = spec.actions.shape[0]

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        greedy: bool = False,
        generator: torch.Generator | None = None,
    ) -> Decision:
        """Decide for R rows; a choice is the first number of its row, float32 (R, widest)."""
        rows = len(observations[self._whose])
        actions, samples = np.zeros((2, rows, self._width), np.float32)
        log_prob, value = np.zeros((2, rows), np.float32)
        for name, mine in self._rows(observations[self._whose]):
            seen, mask = self._seen(name, observations, mine)
            decision = self.members[name].act(seen, mask, greedy, generator)
            _lay(actions, mine, decision.actions)
            _lay(samples, mine, decision.samples)
            log_prob[mine], value[mine] = decision.log_prob, decision.value
        return Decision(actions, samples, log_prob, value)

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions, float32 (R, widest)."""
        actions = np.zeros((len(observations[self._whose]), self._width), np.float32)
        for name, mine in self._rows(observations[self._whose]):
            _lay(actions, mine, self.members[name].choose(*self._seen(name, observations, mine)))
        return actions

    def values(self, observations: Mapping[str, Array]) -> Array:
        """Return what the critics expect from R rows, float32 (R,)."""
        value = np.zeros(len(observations[self._whose]), np.float32)
        for name, mine in self._rows(observations[self._whose]):
            value[mine] = self.members[name].values(self._seen(name, observations, mine)[0])
        return value

    def update(self, experience: Experience) -> PpoLosses:
        """Have every member learn from its own rows.

        Raises:
            DivergedError: A loss of one of them is no longer a number.
        """
        told = []
        for name, mine in self._rows(experience.observations[self._whose][0]):
            told.append(self.members[name].update(self._part_of(experience, name, mine)))
        return merged(told)

    def state_dict(self) -> StateDict:
        """Return the members' states in one, each tensor named "member/…"."""
        state: StateDict = {}
        for name, learner in self.members.items():
            for group, tensors in learner.state_dict().items():
                state.setdefault(group, {}).update({f"{name}/{key}": tensor for key, tensor in tensors.items()})
        return state

    def load_state_dict(self, state: Mapping[str, Mapping[str, torch.Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        for name, learner in self.members.items():
            learner.load_state_dict({group: of_member(tensors, name) for group, tensors in state.items()})

    def _rows(self, whose: Array) -> list[tuple[str, Array]]:
        """Return each member that has rows here, with their numbers."""
        found = [(name, np.flatnonzero(whose == number)) for number, name in enumerate(self.members)]
        return [(name, rows) for name, rows in found if len(rows)]

    def _seen(self, name: str, observations: Mapping[str, Array], rows: Array) -> tuple[dict[str, Array], Array | None]:
        seen = {part: observations[f"{name}/{part}"][rows] for part in self.members[name].spec.observations}
        mask = observations.get(f"{name}/{self._allowed}")
        return seen, None if mask is None else mask[rows]

    def _part_of(self, experience: Experience, name: str, rows: Array) -> Experience:
        """Return a member's columns of a rollout, as it would have kept them itself."""
        learner = self.members[name]
        plain = ("log_prob", "value", "reward", "terminated", "truncated", "active", "final_value")
        shape = learner.spec.actions.shape
        samples = experience.samples[:, rows]
        mask = experience.observations.get(f"{name}/{self._allowed}")
        return replace(
            experience,
            observations={
                part: experience.observations[f"{name}/{part}"][:, rows] for part in learner.spec.observations
            },
            samples=samples[..., : shape[0]] if shape else samples[..., 0].astype(np.int64),
            last_value=experience.last_value[rows],
            action_mask=None if mask is None else mask[:, rows],
            **{part: getattr(experience, part)[:, rows] for part in plain},
        )


Learner = PpoLearner | Committee
"""Whatever learns from a rollout."""


def of_member(named: Mapping[str, Part], name: str) -> dict[str, Part]:
    """Return one member's parts under their own names.

    >>> of_member({"A/weight": 1, "B/weight": 2}, "B")
    {'weight': 2}
    """
    start = f"{name}/"
    return {key.removeprefix(start): part for key, part in named.items() if key.startswith(start)}


def merged(told: list[PpoLosses]) -> PpoLosses:
    """Return the figures of several updates in one: counts added, all else averaged by transitions."""
    weights = [max(losses.transitions, 0) for losses in told]
    weights = weights if sum(weights) else [1] * len(told)
    figures = {}
    for part in fields(PpoLosses):
        values = [getattr(losses, part.name) for losses in told]
        mean = sum(weight * value for weight, value in zip(weights, values, strict=True)) / sum(weights)
        figures[part.name] = sum(values) if part.name in COUNTED else mean
    return PpoLosses(**figures)


def _lay(into: Array, rows: Array, parts: Array) -> None:
    """Write choices (r,) or vectors (r, A) into the first numbers of their rows."""
    wide = parts.reshape(len(rows), -1)
    into[rows, : wide.shape[1]] = wide
