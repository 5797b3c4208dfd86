"""A policy and critic that carry something from tick to tick. Begin with `RecurrentActorCritic`.

Behind the trunk stands one LSTM or GRU cell; the heads read what it gives. A state is one vector for each row: the
GRU's h, or the LSTM's h and c end to end; zeros begin an episode. A critic with a body of its own (the privileged one,
or a separate one) reads that body and the policy's memory, through which it sends no gradient.

Source: Hochreiter and Schmidhuber, "Long short-term memory", 1997; Cho et al., "Learning phrase representations using
RNN encoder-decoder", 2014 (GRU).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.architecture import GRU as GRU
from racecraft.algorithms.architecture import LSTM as LSTM
from racecraft.algorithms.architecture import NONE as NONE
from racecraft.algorithms.networks import ActorCritic, Architecture, allocate_weights
from racecraft.contract.world import Array


@dataclass
class Sequences:
    """S stretches of L ticks that are learned from, one after the other within each."""

    state: Tensor
    """(S, W): what was carried into the first tick of each."""
    begins: Tensor
    """bool (L, S): an episode begins with this tick, so nothing is carried into it (of the first tick: False)."""
    learned: Tensor
    """int64 (B,): places, of L * S laid end to end, that are learned from."""


class RecurrentActorCritic(ActorCritic):
    """An `ActorCritic` whose architecture has a memory."""

    memory: nn.LSTMCell | nn.GRUCell

    def _head_widths(self, architecture: Architecture, generator: torch.Generator) -> tuple[int, int]:
        units = architecture.memory_units
        self.memory = memory_cell(self.policy_body.width, architecture, generator)
        return units, units if self.critic_body is None else self.critic_body.width + units

    @property
    def state_width(self) -> int:
        """W: numbers that are carried for each row."""
        return state_width(self.memory)

    def carry(self, observations: Mapping[str, Tensor], state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return the policy's parameters (R, P), values (R,) and the new state (R, W) of R rows."""
        after = self._step(self.policy_body(observations).float(), state)
        read = after[:, : self.memory.hidden_size]
        return self.policy_head(read), self._value(observations, read), after

    def policy_carry(self, observations: Mapping[str, Tensor], state: Tensor) -> tuple[Tensor, Tensor]:
        """Return the policy's parameters and the new state alone; needs no privileged observation."""
        after = self._step(self.policy_body(observations).float(), state)
        return self.policy_head(after[:, : self.memory.hidden_size]), after

    def run(self, observations: Mapping[str, Tensor], sequences: Sequences) -> tuple[Tensor, Tensor]:
        """Return parameters (B, P) and values (B,) of the ticks learned from; gradients flow back through each stretch.

        Args:
            observations: (L * S, ...) by name, tick by tick.
            sequences: How they hang together.
        """
        ticks, count = sequences.begins.shape
        features = self.policy_body(observations).float().view(ticks, count, -1)
        carried = (~sequences.begins).float().unsqueeze(2)
        state, read = sequences.state, []
        for tick in range(ticks):
            state = self._step(features[tick], state * carried[tick])
            read.append(state[:, : self.memory.hidden_size])
        hidden = torch.cat(read).index_select(0, sequences.learned)
        if self.critic_body is None:
            return self.policy_head(hidden), self.value_head(hidden).squeeze(-1)
        seen = {name: part.index_select(0, sequences.learned) for name, part in observations.items()}
        return self.policy_head(hidden), self._value(seen, hidden)

    def _step(self, features: Tensor, state: Tensor) -> Tensor:
        if isinstance(self.memory, nn.GRUCell):
            stepped: Tensor = self.memory(features, state)
            return stepped
        units = self.memory.hidden_size
        return torch.cat(self.memory(features, (state[:, :units], state[:, units:])), dim=1)

    def _value(self, observations: Mapping[str, Tensor], read: Tensor) -> Tensor:
        if self.critic_body is None:
            return self.value_head(read).squeeze(-1)
        features = torch.cat([self.critic_body(observations).float(), read.detach()], dim=1)
        return self.value_head(features).squeeze(-1)


class RowStates:
    """What is carried for each row; zeros where an episode begins.

    Args:
        width: W.
        device: Where it is.
    """

    def __init__(self, width: int, device: torch.device) -> None:
        self.table = torch.zeros((0, width), device=device)
        """(R, W)."""

    @torch.inference_mode()
    def of(self, rows: Array | None, count: int) -> Tensor:
        """Return the states (R, W) of rows (int64 (R,); None: the first `count`); copies."""
        rows = np.arange(count) if rows is None else rows
        self._grow(int(rows.max()) + 1 if len(rows) else 0)
        return self.table[torch.from_numpy(rows).to(self.table.device)]

    @torch.inference_mode()
    def keep(self, rows: Array | None, states: Tensor) -> None:
        """Carry these on."""
        rows = np.arange(len(states)) if rows is None else rows
        self._grow(int(rows.max()) + 1 if len(rows) else 0)
        self.table[torch.from_numpy(rows).to(self.table.device)] = states

    @torch.inference_mode()
    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows (bool (R,))."""
        self._grow(len(rows))
        self.table[: len(rows)][torch.from_numpy(rows).to(self.table.device)] = 0.0

    def _grow(self, rows: int) -> None:
        more = rows - len(self.table)
        if more > 0:
            self.table = torch.cat([self.table, self.table.new_zeros((more, self.table.shape[1]))])


def memory_cell(width: int, architecture: Architecture, generator: torch.Generator) -> nn.LSTMCell | nn.GRUCell:
    """Return the cell with its first weights: orthogonal gate by gate, biases 0 but 1 for what an LSTM keeps."""
    units = architecture.memory_units
    kind: type[nn.LSTMCell | nn.GRUCell] = nn.LSTMCell if architecture.memory == LSTM else nn.GRUCell
    cell = kind(width, units, device="meta")
    allocate_weights(cell)
    with torch.no_grad():
        for weights in (cell.weight_ih, cell.weight_hh):
            for gate in weights.split(units):
                nn.init.orthogonal_(gate, generator=generator)
        for bias in (cell.bias_ih, cell.bias_hh):
            nn.init.zeros_(bias)
        if isinstance(cell, nn.LSTMCell):
            cell.bias_ih[units : 2 * units] = 1.0
    return cell


def state_width(cell: nn.LSTMCell | nn.GRUCell) -> int:
    """Return how many numbers a cell carries for each row."""
    return cell.hidden_size * (2 if isinstance(cell, nn.LSTMCell) else 1)
