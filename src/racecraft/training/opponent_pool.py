"""Past selves of a learner, one of which is met at a time. Begin with `OpponentPool`.

Every few updates the learner's weights enter the pool and the oldest leave it; after every update one of them is drawn.
The pool knows no world: to a world its present opponent is a `Policy` like another.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from racecraft.algorithms.learner import Learner
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array
from racecraft.players.trained import policy_from


class OpponentPool:
    """Past selves, and the one that plays now. It is a `Policy`, and a `Stateful` part of a training.

    Args:
        spec: How their policy is rebuilt from weights.
        first: Weights of the self that the pool begins with, as arrays by name.
        size: Past selves in the pool; the oldest leave it.
        every: A self enters after so many updates.
        seed: Of the draws from the pool.
    """

    def __init__(self, spec: PolicySpec, first: Mapping[str, Array], size: int, every: int, seed: int) -> None:
        self._spec, self._every, self._seed = spec, every, seed
        self.selves: deque[dict[str, Array]] = deque([dict(first)], maxlen=size)
        """Weights, oldest first."""
        self.updates = 0
        """Updates of the learner so far."""
        self._chance = torch.Generator()
        self._draw()

    def begin(self, seed: int) -> None:
        """Take up new dice for the moves of whoever plays."""
        self._chance.manual_seed(seed)

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return the present opponent's actions (R, …), drawn by their probability where its policy knows one."""
        sample = getattr(self._opponent, "sample", None)
        if sample is None:
            return np.asarray(self._opponent.act(observations, action_mask))
        return np.asarray(sample(observations, action_mask, self._chance))

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self._opponent.reset_state(rows)

    def learned(self, learner: Learner) -> None:
        """Hear of an update: now and then the learner enters the pool, and an opponent is drawn anew."""
        self.updates += 1
        if self.updates % self._every == 0:
            self.selves.append(to_arrays(learner.state_dict())["network"])
        self._draw()

    def state(self) -> dict[str, Any]:
        """Return the pool, its count and its dice (copies)."""
        return {
            "updates": self.updates,
            "selves": [dict(weights) for weights in self.selves],
            "chance": self.dice(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self.updates = int(state["updates"])
        self.selves.clear()
        self.selves.extend(dict(weights) for weights in state["selves"])
        self.set_rng_state(state["chance"])
        self._draw()

    def dice(self) -> Array:
        """Return how the dice of whoever plays stand (a copy)."""
        return self._chance.get_state().numpy().copy()

    def set_rng_state(self, dice: Array) -> None:
        """Go on with dice as they stood."""
        self._chance.set_state(torch.from_numpy(np.asarray(dice)))

    def _draw(self) -> None:
        chosen = int(generator(self._seed + self.updates, "past self").integers(len(self.selves)))
        self._opponent: Any = policy_from(self._spec, to_tensors(self.selves[chosen]))
