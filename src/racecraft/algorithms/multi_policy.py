"""Several policies that learn side by side in one world, each from its own rows. Begin with `MultiPolicyLearner`.

Who a row belongs to is told by the observation `POLICY_ID` of the row itself, so that any subset of rows can be decided
or valued. Towards the collector, the loop and the files it is one learner; inside, every member is a learner as ever,
with its own network, settings and optimiser, and sees its own observations under its own names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.learner import ROLLOUT, Decision, Learner, StateDict, greedy_policy_of
from racecraft.algorithms.policy_spec import MULTI_POLICY, PolicySpec
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import POLICY_ID, AgentGroup, Array, ArraySpec, WorldSpec, mask_width

Part = TypeVar("Part")

COUNTED = ("transitions", "minibatches")
"""Figures that are added up; all others are means, weighted by transitions."""


class MultiPolicyLearner:
    """Learners by the name of their group.

    Args:
        spec: The world's promise, with its groups.
        members: One learner for each group, in the groups' order; each made for `group_spec`.
        still: Groups that act and learn nothing.
    """

    experience = ROLLOUT

    def __init__(self, spec: WorldSpec, members: Mapping[str, Learner], still: frozenset[str] = frozenset()) -> None:
        self.spec, self.members, self._still = spec, dict(members), still
        self.device = next(iter(self.members.values())).device
        self.columns = {
            f"{name}/{column}": part for name, learner in members.items() for column, part in learner.columns.items()
        }

    @property
    def figures(self) -> Mapping[str, str]:
        """What an update tells."""
        figures: Mapping[str, str] = getattr(next(iter(self.members.values())), "figures", {})
        return figures

    @property
    def policy_spec(self) -> PolicySpec:
        """The members' specs, by their groups."""
        return PolicySpec(
            MULTI_POLICY,
            dict(self.spec.observations),
            self.spec.actions,
            has_action_mask=self.spec.has_action_mask,
            policies={name: learner.policy_spec for name, learner in self.members.items()},
        )

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows; an action stands in the first numbers of its row, float32 (R, widest)."""
        count = len(observations[POLICY_ID])
        actions = np.zeros((count, *self.spec.actions.shape), np.float32)
        columns = {name: np.zeros((count, *part.shape), part.dtype) for name, part in self.columns.items()}
        for name, mine in rows_by_group(observations[POLICY_ID], self.members):
            seen, mask = part_of(self.members[name].spec, name, observations, action_mask, mine)
            own = mine if rows is None else rows[mine]
            decision = self.members[name].act(seen, mask, generator=generator, rows=own)
            write_rows(actions, mine, decision.actions)
            for column, values in decision.columns.items():
                columns[f"{name}/{column}"][mine] = values
        return Decision(actions, columns)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        for learner in self.members.values():
            learner.reset_state(rows)

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions, float32 (R, widest)."""
        return choose_by_group(self.spec, self.members, observations, action_mask)

    def greedy_policy(self) -> MultiPolicy:
        """Return the members' greedy policies as one, with memories of their own."""
        members = {name: greedy_policy_of(learner) for name, learner in self.members.items()}
        return MultiPolicy(self.policy_spec, members)

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Have every member learn from its own rows.

        Raises:
            DivergedError: A loss of one of them is no longer a number.
        """
        metrics = []
        for name, mine in rows_by_group(experience.observations[POLICY_ID][0], self.members):
            if name not in self._still:
                metrics.append(self.members[name].update(self._part_of(experience, name, mine)))
        return merged(metrics)

    def anneal(self, done: float) -> None:
        """Follow the schedules of all members."""
        for learner in self.members.values():
            if hasattr(learner, "anneal"):
                learner.anneal(done)

    def state_dict(self) -> StateDict:
        """Return the members' states in one, each tensor named "member/…"."""
        state: StateDict = {}
        for name, learner in self.members.items():
            for group, tensors in learner.state_dict().items():
                state.setdefault(group, {}).update({f"{name}/{key}": tensor for key, tensor in tensors.items()})
        return state

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        for name, learner in self.members.items():
            learner.load_state_dict({group: of_member(tensors, name) for group, tensors in state.items()})

    def _part_of(self, batch: RolloutBatch, name: str, rows: Array) -> RolloutBatch:
        """Return a member's rows of a rollout, as it would have kept them itself."""
        mine, learner = batch.of_rows(rows), self.members[name]
        spec = learner.spec
        width = mask_width(spec) if spec.has_action_mask else None
        return replace(
            mine,
            observations=_own(mine.observations, name, spec.observations),
            last_observations=_own(mine.last_observations, name, spec.observations),
            final_observations=_own(mine.final_observations, name, spec.observations)
            if mine.final_observations
            else {},
            actions=narrow(mine.actions, spec),
            columns=of_member(mine.columns, name),
            action_mask=None if width is None or mine.action_mask is None else mine.action_mask[..., :width],
            last_action_mask=(
                None if width is None or mine.last_action_mask is None else mine.last_action_mask[..., :width]
            ),
        )


class MultiPolicy:
    """Greedy policies of several groups as one.

    Args:
        spec: What all of them together see and do.
        members: By group, in the groups' order.
    """

    def __init__(self, spec: PolicySpec, members: Mapping[str, Any]) -> None:
        self.spec, self.members = spec, dict(members)
        self._rows: dict[str, Array] = {}
        """Which rows were whose when they acted; a member counts its own from 0."""

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions, float32 (R, widest)."""
        actions = np.zeros((len(observations[POLICY_ID]), *self.spec.actions.shape), np.float32)
        for name, mine in rows_by_group(observations[POLICY_ID], self.members):
            seen, mask = part_of(self.spec.policies[name], name, observations, action_mask, mine)
            write_rows(actions, mine, self.members[name].act(seen, mask))
            self._rows[name] = mine
        return actions

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        for name, mine in self._rows.items():
            self.members[name].reset_state(rows[mine[mine < len(rows)]])


def group_spec(name: str, group: AgentGroup, num_rows: int) -> WorldSpec:
    """Return what a group's agents alone would promise, as worlds of one agent."""
    return WorldSpec(name, num_rows, 1, group.observations, group.actions, group.has_action_mask)


def choose_by_group(
    spec: WorldSpec, members: Mapping[str, Learner], observations: Mapping[str, Array], action_mask: Array | None
) -> Array:
    """Return every row's greedy action from its own member, float32 (R, widest)."""
    actions = np.zeros((len(observations[POLICY_ID]), *spec.actions.shape), np.float32)
    for name, mine in rows_by_group(observations[POLICY_ID], members):
        write_rows(
            actions, mine, members[name].choose(*part_of(members[name].spec, name, observations, action_mask, mine))
        )
    return actions


def rows_by_group(policy_id: Array, names: Mapping[str, Any]) -> list[tuple[str, Array]]:
    """Return each group that has rows here, with their numbers."""
    found = [(name, np.flatnonzero(policy_id == number)) for number, name in enumerate(names)]
    return [(name, rows) for name, rows in found if len(rows)]


def part_of(
    spec: Any, name: str, observations: Mapping[str, Array], action_mask: Array | None, rows: Array
) -> tuple[dict[str, Array], Array | None]:
    """Return what a group's rows see, under its own names, and what they are allowed."""
    seen = {part: observations[f"{name}/{part}"][rows] for part in spec.observations}
    masked = action_mask is not None and spec.has_action_mask
    return seen, action_mask[rows, : mask_width(spec)] if masked and action_mask is not None else None


def narrow(actions: Array, spec: WorldSpec) -> Array:
    """Return a group's own actions (…, *shape) out of the widest (…, W)."""
    shape = spec.actions.shape
    own = actions[..., : shape[0]] if shape else actions[..., 0]
    return np.asarray(own, spec.actions.dtype)


def write_rows(into: Array, rows: Array, parts: Array) -> None:
    """Write choices (r,) or vectors (r, A) into the first numbers of their rows."""
    wide = parts.reshape(len(rows), -1)
    into[rows, : wide.shape[1]] = wide


def of_member(named: Mapping[str, Part], name: str) -> dict[str, Part]:
    """Return one member's parts under their own names.

    >>> of_member({"A/weight": 1, "B/weight": 2}, "B")
    {'weight': 2}
    """
    start = f"{name}/"
    return {key.removeprefix(start): part for key, part in named.items() if key.startswith(start)}


def merged(metrics: list[Mapping[str, float]]) -> dict[str, float]:
    """Return the figures of several updates in one: counts added, all else averaged by transitions."""
    weights = [max(figures.get("transitions", 0), 0) for figures in metrics]
    weights = weights if sum(weights) else [1] * len(metrics)
    together: dict[str, float] = {}
    for name in dict.fromkeys(name for figures in metrics for name in figures):
        values = [figures.get(name, 0.0) for figures in metrics]
        mean = sum(weight * value for weight, value in zip(weights, values, strict=True)) / sum(weights)
        together[name] = sum(values) if name in COUNTED else mean
    return together


def _own(named: Mapping[str, Array], name: str, parts: Mapping[str, ArraySpec]) -> dict[str, Array]:
    return {part: named[f"{name}/{part}"] for part in parts}
