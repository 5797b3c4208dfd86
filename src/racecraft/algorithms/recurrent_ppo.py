"""PPO for a policy with a memory, on one page: what is other than in `ppo.py`. Begin with `RecurrentPpoLearner`.

Each row carries a state while it acts; what was carried into a tick is noted beside the transition. An update cuts
every row into stretches of `ppo.sequence_length` ticks, begins each with the noted state, lets nothing pass from one
episode to the next, and sends gradients back through a stretch and no further (truncated backpropagation through
time). A minibatch is whole stretches. Ticks that are not to be learned from are passed through and not counted.

The noted states are those of the weights that acted, as in the implementations that were measured; they grow stale only
within the epochs of one update.

Results are bit-identical on the same machine, threads and versions: what is carried is part of `state_dict`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.half_precision import processor_precision
from racecraft.algorithms.learner import StateDict
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.ppo import VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.recurrent_network import RecurrentActorCritic, RowStates, Sequences
from racecraft.algorithms.recurrent_policy import RecurrentPolicy
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, ArraySpec, WorldSpec

CARRIED = "carried"
"""Column: the state that a row carried into the tick."""


class RecurrentPpoLearner(PpoLearner):
    """A `PpoLearner` whose network has a memory; the same arguments.

    Raises:
        SettingError: bfloat16 is asked for; memories multiply in float32.
    """

    supported_network_settings = ("memory", *PpoLearner.supported_network_settings)
    network: RecurrentActorCritic

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: PpoConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        if processor_precision(config.precision) == "bfloat16":
            raise SettingError(
                "ppo.precision is {precision}, bfloat16 here; a policy with network.memory multiplies in "
                "float32. Give --set ppo.precision=float32.",
                precision=config.precision,
            )
        super().__init__(spec, network, config, seed, device)
        self.values_later = False
        width = self.network.state_width
        self.columns = {
            **self.columns,
            VALUE: ArraySpec((), np.float32, doc="what the critic expected"),
            CARRIED: ArraySpec((width,), np.float32, doc="what was carried into the tick"),
        }
        self.states = RowStates(width, self.device)
        nothing = torch.zeros(0, dtype=torch.bool, device=self.device)
        self._states_noted, self._stretches = nothing.float(), nothing.long()
        self._begins, self._active = nothing, nothing
        """Of the rollout that is learned from: (T * R, W), (L, S), (T * R,), (T * R,)."""

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.states.reset_state(rows)

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions of rows whose episode has just begun; `greedy_policy` plays on from tick to tick."""
        return self.greedy_policy().act(observations, action_mask)

    def greedy_policy(self) -> RecurrentPolicy:
        """Return the greedy policy, with states of its own; it follows what is learned."""
        return RecurrentPolicy(self.network, self.distribution)

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, what is carried included."""
        return {**super().state_dict(), "memory": {"carried": self.states.table.clone()}}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        super().load_state_dict(state)
        if "memory" in state:
            self.states.table = state["memory"]["carried"].clone().to(self.device)

    def _look(self, seen: dict[str, Tensor], rows: Array | None) -> tuple[Tensor, dict[str, Array]]:
        before = self.states.of(rows, len(next(iter(seen.values()))))
        params, value, after = self.network.carry(seen, before)
        self.states.keep(rows, after)
        return params, {VALUE: value.cpu().numpy(), CARRIED: before.cpu().numpy()}

    def _prepare(self, batch: RolloutBatch) -> tuple[Minibatch, Tensor, tuple[float, float]]:
        whole, rows, facts = super()._prepare(batch)
        ended = (batch.terminated | batch.truncated).reshape(-1)
        after_end = np.zeros_like(ended)
        after_end[batch.shape[1] :] = ended[: -batch.shape[1]]
        self._begins = torch.from_numpy(after_end).to(self.device)
        noted = batch.columns[CARRIED]
        self._states_noted = torch.from_numpy(noted.reshape(-1, noted.shape[-1])).to(self.device)
        self._active = torch.from_numpy(batch.active.reshape(-1)).to(self.device)
        self._stretches = torch.from_numpy(stretches(batch.active, self.config.sequence_length)).to(self.device)
        return whole, rows, facts

    @torch.inference_mode()
    def _next_values(self, batch: RolloutBatch, value: Array) -> Array:
        """Return what followed each tick, float32 (T, R); what is carried is told by one tick more of the memory."""
        ended = batch.terminated[-1] | batch.truncated[-1]
        carried = self._carried_on(
            {name: part[-1] for name, part in batch.observations.items()}, batch.columns[CARRIED][-1]
        )
        carried[torch.from_numpy(ended).to(self.device)] = 0.0
        following = np.concatenate([value[1:], self._values_from(batch.last_observations, carried)[None]])
        if len(cut := batch.final_index):
            flat = {name: part.reshape(-1, *part.shape[2:])[cut] for name, part in batch.observations.items()}
            noted = batch.columns[CARRIED]
            carried = self._carried_on(flat, noted.reshape(-1, noted.shape[-1])[cut])
            following[batch.final_places] = self._values_from(batch.final_observations, carried)
        return following

    def _carried_on(self, observations: Mapping[str, Array], carried: Array) -> Tensor:
        state = torch.from_numpy(np.ascontiguousarray(carried)).to(self.device)
        return self.network.policy_carry(self._tensors(observations), state)[1]

    def _values_from(self, observations: Mapping[str, Array], carried: Tensor) -> Array:
        return self.network.carry(self._tensors(observations), carried)[1].cpu().numpy()

    def _minibatches(self, rows: Tensor) -> Iterator[Tensor]:
        """Yield stretches in a new order, (L, S) places each, about `batch_size` ticks at a time."""
        size = max(1, self.config.batch_size // self.config.sequence_length)
        count = self._stretches.shape[1]
        order = torch.randperm(count, generator=self.generator, device=self.device)
        for picked in order.split(size):
            if len(picked) == size or count < size or not self.config.drop_remainder:
                yield self._stretches[:, picked]

    def _taken(self, whole: Minibatch, picked: Tensor) -> Minibatch:
        """Return the ticks of these stretches that are learned from, with all that leads to them."""
        flat, ticks = picked.clamp(min=0).reshape(-1), picked.shape[0]
        begins = self._begins[flat].view(picked.shape)
        begins[0] = False  # what was noted for it knows of the episode's beginning already
        counted = (picked.reshape(-1) >= 0) & self._active[flat]
        learned = torch.nonzero(counted).squeeze(1)
        batch = whole.take(flat[learned])
        batch.observations = {name: part.index_select(0, flat) for name, part in whole.observations.items()}
        batch.sequences = Sequences(self._states_noted[flat[: len(flat) // ticks]], begins, learned)
        return batch


def stretches(active: Array, length: int) -> Array:
    """Return the places t * R + r of every stretch, int64 (L, S), -1 behind a rollout's end; idle ones are left out.

    >>> stretches(np.array([[True, False], [True, False], [True, False]]), 2)
    array([[ 0,  4],
           [ 2, -1]])
    """
    ticks, rows = active.shape
    at = np.arange(0, ticks, length)[None, :, None] + np.arange(length)[:, None, None]  # (L, starts, 1)
    places = np.where(at < ticks, at * rows, -1 - rows) + np.arange(rows)
    places = np.maximum(places, -1).reshape(length, -1)
    lively = (active.reshape(-1)[np.maximum(places, 0)] & (places >= 0)).any(axis=0)
    chosen: Array = places[:, lively]
    return chosen
