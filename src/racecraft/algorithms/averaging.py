"""A running mean of a learner's weights, by which it is judged and kept. Begin with `AveragedLearner`.

What a policy does at its limits changes from update to update: of a car's checkpoints 20 updates apart one finished
92 % of its starts, the next 35 %. The mean of the latest weights is steadier (Polyak and Juditsky, "Acceleration of
stochastic approximation by averaging", 1992; benchmarks/racing.md). What explores and learns goes by the latest
weights, as ever.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import torch
from torch import Tensor

from racecraft.algorithms.compiled_policy import CompiledPolicy
from racecraft.algorithms.learner import Compilable, Learner, StateDict
from racecraft.algorithms.learner_wrapper import LearnerWrapper
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.weights import MEAN, NETWORK
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array

LoadPolicy = Callable[[PolicySpec, Mapping[str, Tensor]], Policy]
STATE = "averaging"


class AveragedLearner(LearnerWrapper):
    """A learner whose greedy policy has the mean of its latest weights; towards those who explore it is that learner.

    Args:
        inner: Who learns.
        share: Of all updates so far, over how many the mean is taken, 0 to 1: after 1000 updates and with 0.1 some 100.
        load_policy: Makes a policy of a spec and its weights.
    """

    def __init__(self, inner: Learner, share: float, load_policy: LoadPolicy) -> None:
        super().__init__(inner)
        self.share, self.updates = share, 0
        self.mean = dict(inner.state_dict()[NETWORK])
        self._load_policy = load_policy

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions by the mean."""
        return self.policy().act(observations, action_mask)

    def policy(self) -> Policy:
        """Return the greedy policy with the mean as it stands now."""
        return self._load_policy(self.inner.policy_spec, self.mean)

    def greedy_policy(self) -> MeanPolicy:
        """Return the greedy policy by the mean; it follows what is learned."""
        return MeanPolicy(self)

    def update(self, experience: Any) -> Mapping[str, float]:
        """Have the inner learner learn, and take its weights into the mean."""
        figures = self.inner.update(experience)
        newest = self.inner.state_dict()[NETWORK]
        weight = 1.0 / (1.0 + self.share * self.updates)
        self.mean = {
            name: torch.lerp(self.mean[name], part, weight) if part.is_floating_point() else part
            for name, part in newest.items()
        }
        self.updates += 1
        return figures

    def state_dict(self) -> StateDict:
        """Return the inner learner's state, the mean, and how many updates it has seen."""
        return {**self.inner.state_dict(), MEAN: dict(self.mean), STATE: {"updates": torch.tensor(self.updates)}}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; of weights alone the mean begins with them."""
        self.inner.load_state_dict(state)
        own = state.get(STATE)
        self.updates = int(own["updates"]) if own else 0
        self.mean = dict(state[MEAN]) if own else dict(self.inner.state_dict()[NETWORK])


class MeanPolicy:
    """The greedy policy of an `AveragedLearner`, which follows its mean; after an update its memory begins anew.

    Args:
        learner: Whose.
    """

    def __init__(self, learner: AveragedLearner) -> None:
        self._learner, self._mean, self._policy = learner, learner.mean, learner.policy()

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row (R, …)."""
        return self._newest().act(observations, action_mask)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self._newest().reset_state(rows)

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return the policy's; see `Compilable`."""
        policy = self._newest()
        return policy.compile_policy(name, frame) if isinstance(policy, Compilable) else None

    def _newest(self) -> Policy:
        if self._mean is not self._learner.mean:
            self._mean, self._policy = self._learner.mean, self._learner.policy()
        return self._policy
