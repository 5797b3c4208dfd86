"""PPO whose learner works beside its actors, on one page. Begin with `AsynchronousPpo.update`.

A thread learns from the rollout before while worlds, here or in other processes, go on with the weights that it began
with; both wait for each other once a rollout. So what is learned from was decided by weights one update old, and
V-trace weighs it (`returns.py`; Espeholt et al., "IMPALA", 2018): targets and advantages are those of the policy as
the update finds it, the clip holds it near to that policy, and what it would hardly have decided counts little. With
nothing old in a rollout this is PPO.

Who waits for whom hangs on no clock, so a training is bit by bit the same again, and a resumed one learns once more
from the rollout that was under way, which stands in its checkpoint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.learner import ACTING, StateDict
from racecraft.algorithms.learner_wrapper import LearnerWrapper
from racecraft.algorithms.ppo import FIGURES as PPO_FIGURES
from racecraft.algorithms.ppo import LOG_PROB, RAW_ACTION, ROWS_AT_ONCE, PpoLearner
from racecraft.algorithms.ppo_batch import Advantages
from racecraft.algorithms.recurrent_network import RecurrentActorCritic
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, WorldSpec
from racecraft.settings.composition import Settings

UNDER_WAY, DONE = "under_way", "done"
"""Group of the state with the rollout that is being learned from, and in it how much of the training lay behind."""

FIGURES = {
    **PPO_FIGURES,
    "mean_weight": "How much a transition counted, at most `ppo.ratio_cap`: 1 where today's policy would have decided "
    "the same as the one that acted.",
}
"""What an update tells: of the learning that went on beside the collecting before it."""


class CorrectedPpoLearner(PpoLearner):
    """A `PpoLearner` that weighs decisions of older weights by V-trace; the same arguments."""

    mean_weight = 1.0
    """How much a transition of the latest rollout counted; below 1 where older weights decided it."""

    def compute_advantages(self, batch: RolloutBatch) -> Advantages:
        """Return how good every decision of a rollout was, by today's weights."""
        return self._advantages(batch, *self._evaluate_again(batch))

    @torch.inference_mode()
    def _evaluate_again(self, batch: RolloutBatch) -> tuple[Array, Array, Array]:
        """Return what today's weights expect, how likely they make what was decided (log), and how much that counts.

        Each float32 (T, R); the last is the ratio of likelihoods, cut at its cap. Rows that are not active count 1 and
        are worth 0.
        """
        active = np.flatnonzero(batch.active.reshape(-1))
        value, log_prob, weights = (np.full(batch.active.size, fill, np.float32) for fill in (0.0, 0.0, 1.0))

        def flat(array: Array) -> Array:
            return array.reshape(-1, *array.shape[2:])

        before = flat(batch.columns[LOG_PROB])
        for rows in np.array_split(active, -(-len(active) // ROWS_AT_ONCE) or 1):
            if not len(rows):
                continue
            seen = self._tensors({name: flat(array)[rows] for name, array in batch.observations.items()})
            mask = (
                None if batch.action_mask is None else torch.from_numpy(flat(batch.action_mask)[rows]).to(self.device)
            )
            raw = torch.from_numpy(flat(batch.columns[RAW_ACTION])[rows]).to(self.device)
            params, worth = self.working(seen)
            likely, _ = self.distribution.log_prob_and_entropy(params, self.network.log_std, mask, raw)
            value[rows], log_prob[rows] = worth.cpu().numpy(), likely.cpu().numpy()
            weights[rows] = np.minimum(np.exp(log_prob[rows] - before[rows]), self.config.ratio_cap)
        self.mean_weight = float(weights[active].mean()) if len(active) else 1.0
        return (
            value.reshape(batch.active.shape),
            log_prob.reshape(batch.active.shape),
            weights.reshape(batch.active.shape),
        )


class AsynchronousPpo(LearnerWrapper):
    """A learner in a thread, and another that acts with its weights. Towards everybody it is one learner.

    Args:
        made: Makes a `CorrectedPpoLearner`; called twice.

    Raises:
        SettingError: It has a memory, whose noted states would be those of older weights.
    """

    figures = FIGURES
    supported_network_settings = ("memory", *PpoLearner.supported_network_settings)
    """A memory is refused by words of its own."""

    @classmethod
    def build(cls, spec: WorldSpec, settings: Settings, seed: int) -> AsynchronousPpo:
        """Return a learner with the settings' groups `network`, `ppo` and `runtime`."""
        return cls(partial(CorrectedPpoLearner.build, spec, settings, seed))

    def __init__(self, made: Callable[[], CorrectedPpoLearner]) -> None:
        actor, self.learner = made(), made()
        if isinstance(actor.network, RecurrentActorCritic):
            raise SettingError(
                "ppo.asynchronous is True, and a memory (network.memory) notes states that its next weights would not "
                "have had. Leave network.memory at none, or ppo.asynchronous at False."
            )
        super().__init__(actor)
        self._beside = ThreadPoolExecutor(max_workers=1, thread_name_prefix="learner")
        self._learning: Future[dict[str, float]] | None = None
        self._under_way: dict[str, Tensor] = {}
        self._done: float | None = None
        self._settled = self._meet()

    def anneal(self, done: float) -> None:
        """Follow the schedules from the next rollout on: `done` is the share of the training that lies behind."""
        self._done = done

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Meet the learner: hear what it learned, take over its weights, give it this rollout; return `FIGURES`.

        The first time there is nothing to hear.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        metrics = {} if self._learning is None else self._learning.result()
        self._settled = self._meet()
        self._begin(tensors_of(experience))
        return metrics

    def state_dict(self) -> StateDict:
        """Return everything as it was when learner and actor last met, and the rollout given then; nobody waits."""
        acting = {name: group for name, group in self.inner.state_dict().items() if name in ACTING}
        under_way = {UNDER_WAY: self._under_way} if self._under_way else {}
        return {**self._settled, **acting, **under_way}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        if self._learning is not None:
            self._learning.result()
        self._learning, self._under_way = None, {}
        self.learner.load_state_dict(state)
        self.inner.load_state_dict({name: group for name, group in state.items() if name in ("network", *ACTING)})
        self._settled = self._meet()
        if under_way := dict(state.get(UNDER_WAY, {})):
            done = float(under_way.pop(DONE))
            self._done = None if done < 0 else done
            self._begin(under_way)

    def _meet(self) -> StateDict:
        """Give the actor the learner's weights; return the learner's whole state."""
        state = self.learner.state_dict()
        self.inner.load_state_dict({"network": state["network"]})
        return state

    def _begin(self, rollout: dict[str, Tensor]) -> None:
        """Have the thread learn from a rollout of its own."""
        if self._done is not None:
            self.learner.anneal(self._done)
        self._under_way = {**rollout, DONE: torch.tensor(-1.0 if self._done is None else self._done)}
        self._learning = self._beside.submit(self._learn, rollout)

    def _learn(self, rollout: Mapping[str, Tensor]) -> dict[str, float]:
        figures = self.learner.update(rollout_of(rollout))
        return {**figures, "mean_weight": self.learner.mean_weight}


def tensors_of(batch: RolloutBatch) -> dict[str, Tensor]:
    """Return a rollout as named tensors (copies), those of its groups as "group/name"."""
    found: dict[str, Tensor] = {}
    for name, part in vars(batch).items():
        if isinstance(part, dict):
            found |= {f"{name}/{key}": torch.tensor(array) for key, array in part.items()}
        elif part is not None:
            found[name] = torch.tensor(part)
    return found


def rollout_of(tensors: Mapping[str, Tensor]) -> RolloutBatch:
    """Return the rollout that `tensors_of` gave, over the same memory."""
    groups: dict[str, dict[str, object]] = {"observations": {}, "last_observations": {}}
    parts: dict[str, object] = {}
    for name, tensor in tensors.items():
        group, _, key = name.partition("/")
        if key:
            groups.setdefault(group, {})[key] = tensor.numpy()
        else:
            parts[name] = tensor.numpy()
    return RolloutBatch(**groups, **parts)  # type: ignore[arg-type]
