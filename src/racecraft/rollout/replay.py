"""What a learner remembers of all it collected, and how it draws from that. Begin with `Replay`.

    transition_ring.py    each observation once; n steps ahead; ends and cuts apart
    priorities.py         how often each transition is drawn

It stands between collector and learner: the loop gives it every rollout (`take`) and gets it back as the learner's
`ReplaySampler`, or None while too little is remembered.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from racecraft.algorithms.replay_sampler import VALUE_BEST, VALUE_TAKEN, Transitions
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.stacking import AGE
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, ArraySpec, WorldSpec
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.transition_ring import COLUMN, NOBODY, TransitionRing, ring_bytes

if TYPE_CHECKING:
    from racecraft.rollout.priorities import Priorities

GIB, MIB = 2**30, 2**20
TREE_BYTES = 18
"""Of the sum tree, for each place: a weight, its running sum, and a fifteenth of both for the levels above."""
RARE = 0.01
"""With a smaller share of ticks to learn from, places are drawn from a list of them and not again and again."""


class Replay:
    """The newest transitions, drawn all alike or by their priority.

    Args:
        spec: The world's promise.
        config: The settings.
        discount: Weight of the next tick's value (gamma).
        n_step: Steps of reward that are summed, 1 or more.
        columns: What the learner notes of its decisions; with `VALUE_TAKEN` and `VALUE_BEST` among it, what is new has
            a priority of its own; with `AGE`, what is drawn can be stacked.
        stack_size: How many observations what is drawn shows at once; each is kept once all the same.

    One thread may take in while another draws.

    Raises:
        SettingError: It would need more memory than is allowed, or than the machine has.
    """

    def __init__(
        self,
        spec: WorldSpec,
        config: ReplayConfig,
        discount: float,
        n_step: int = 1,
        columns: Mapping[str, ArraySpec] | None = None,
        stack_size: int = 1,
    ) -> None:
        self.config, self.discount, self.n_step = config, discount, n_step
        self.rows = spec.num_worlds * spec.num_agents
        ticks = max(-(-config.capacity // self.rows), n_step + 1)
        self._foreseen = config.prioritised and {VALUE_TAKEN, VALUE_BEST} <= set(columns or {})
        """Whether the actors' own values give what is new its priority."""
        wanted = (*((VALUE_TAKEN, VALUE_BEST) if self._foreseen else ()), *((AGE,) if stack_size > 1 else ()))
        noted = {name: (columns or {})[name] for name in wanted}
        self.bytes = ring_bytes(spec, ticks, noted) + (
            TREE_BYTES * (ticks + 1) * self.rows if config.prioritised else 0
        )
        _require_memory(self.bytes, ticks * self.rows, config)
        self.ring = TransitionRing(spec, ticks, noted, stack_size)
        self._lock = threading.RLock()
        self.prioritised = config.prioritised
        self.priorities: Priorities | None = None
        if config.prioritised:  # whoever draws all alike starts without compiled kernels
            from racecraft.rollout.priorities import Priorities

            self.priorities = Priorities(self.ring.slots * self.rows, config.priority_exponent)
        self.new_transitions, self.collected = 0, 0
        self.begins_anew = False
        """Whether a resumed run had to begin it anew, as it was too large to be kept."""
        self._count = 0

    def __len__(self) -> int:
        """Return how many transitions may be drawn."""
        return self._count

    @property
    def importance(self) -> float:
        """How far the drawing is weighed out now (beta)."""
        first = self.config.importance_exponent
        return first + (1.0 - first) * min(self.collected / self.config.importance_steps, 1.0)

    def add(self, batch: RolloutBatch) -> Replay | None:
        """Take in a rollout; return None while fewer than `learning_starts` transitions are remembered."""
        with self._lock:
            before = self.ring.head
            given_up = self.ring.put(batch)
            self.new_transitions = batch.num_active
            self.collected += self.new_transitions
            self._count = int(self._active(self.ring.oldest, self._ready).sum())
            if self.priorities is not None:
                self._weigh(self.priorities, before, given_up)
        is_full = self.ring.head >= self.ring.ticks
        return self if self._count >= (1 if is_full else self.config.learning_starts) else None

    def sample(self, batch_size: int, generator: torch.Generator) -> Transitions:
        """Draw transitions, with replacement; see `ReplaySampler`."""
        with self._lock:
            if self.priorities is None:
                return self.ring.gather(self._draw_alike(batch_size, generator), self.n_step, self.discount)
            uniform = torch.rand(batch_size, generator=generator, device=generator.device, dtype=torch.float64)
            index, share = self.priorities.draw(uniform.cpu().numpy())
            drawn = self.ring.gather(index, self.n_step, self.discount)
        weights = (self._count * share) ** -self.importance
        drawn.weights = (weights / weights.max()).astype(np.float32)
        return drawn

    def set_priorities(self, index: Array, errors: Array) -> None:
        """Say how wrong was what was expected of the transitions in these places; see `ReplaySampler`."""
        if self.priorities is not None:
            with self._lock:
                self.priorities.set_errors(index, errors)

    def state(self) -> dict[str, Any]:
        """Return everything, where it is small enough for a checkpoint; else only that it was not."""
        state: dict[str, Any] = {"collected": self.collected, "kept": self._filled_bytes <= self.config.keep_mib * MIB}
        if state["kept"]:
            with self._lock:
                state["ring"] = self.ring.state()
                if self.priorities is not None:
                    state["weights"] = self.priorities.leaves.copy()
                    state["largest"] = self.priorities.largest
        return state

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave; where it was too large to be kept, begin anew."""
        self.collected, self.begins_anew = state["collected"], not state["kept"]
        if self.begins_anew:
            return
        self.ring.restore(state["ring"])
        self._count = int(self._active(self.ring.oldest, self._ready).sum())
        if self.priorities is not None:
            self.priorities.set(np.arange(self.priorities.count), state["weights"])
            self.priorities.largest = state["largest"]

    @property
    def _ready(self) -> int:
        """Number of the first tick whose n steps (and what was then expected, where that counts) are not seen yet."""
        return max(self.ring.oldest, self.ring.head - self.n_step + (0 if self._foreseen else 1))

    @property
    def _filled_bytes(self) -> float:
        return self.bytes * min(self.ring.head + 1, self.ring.slots) / self.ring.slots

    def _active(self, first: int, last: int) -> Array:
        """Return which of these ticks may be learned from, bool (ticks * R,)."""
        slots = np.arange(first, last) % self.ring.slots
        active: Array = self.ring.arrays["active"][slots].reshape(-1)
        return active

    def _draw_alike(self, count: int, generator: torch.Generator) -> Array:
        """Return places, each as likely."""
        first, last = self.ring.oldest, self._ready
        among = (last - first) * self.rows
        listed = None
        if self._count < RARE * among:
            listed = np.flatnonzero(self._active(first, last))
        drawn = self._numbers(count, among if listed is None else len(listed), generator)
        if listed is not None:
            return self._place(listed[drawn], first)
        places, active = self._place(drawn, first), self.ring.flat("active")
        while len(wrong := np.flatnonzero(~active[places])):
            places[wrong] = self._place(self._numbers(len(wrong), among, generator), first)
        return places

    def _numbers(self, count: int, below: int, generator: torch.Generator) -> Array:
        drawn = torch.randint(below, (count,), generator=generator, device=generator.device)
        numbers: Array = drawn.cpu().numpy()
        return numbers

    def _place(self, number: Array, first: int) -> Array:
        """Return the places of transitions counted from tick `first` on."""
        place: Array = (number + first * self.rows) % (self.ring.slots * self.rows)
        return place

    def _weigh(self, priorities: Priorities, before: int, given_up: Array) -> None:
        """Give weights to what has become ready since tick number `before`, and none to what made room or is lost."""
        ring, head = self.ring, self.ring.head
        priorities.set(ring.places(max(before, head - ring.ticks), head + 1), 0.0)
        priorities.set(given_up, 0.0)
        first = max(ring.oldest, before - self.n_step + (0 if self._foreseen else 1))
        if self._ready > first:
            ready = ring.places(first, self._ready)
            weights = priorities.weights_of(self._errors(ready)) if self._foreseen else priorities.largest
            priorities.set(ready, np.where(ring.flat("active")[ready], weights, 0.0))

    def _errors(self, places: Array) -> Array:
        """Return how wrong the actors were, by their own later word, float32 (B,).

        Of a final observation nobody said what it is worth; the one before stands for it.
        """
        total, weight, then, cut = self.ring.look_ahead(places, self.n_step, self.discount)
        best, taken = self.ring.flat(COLUMN + VALUE_BEST), self.ring.flat(COLUMN + VALUE_TAKEN)
        errors: Array = total + weight * best[np.where(cut == NOBODY, then, cut)] - taken[places]
        return errors


def _require_memory(needed: int, capacity: int, config: ReplayConfig) -> None:
    """Refuse a memory that is larger than is allowed, or than the machine's.

    Raises:
        SettingError: The message says what would fit.
    """
    here = machine_bytes()
    allowed, whose = config.memory_gib * GIB, f"replay.memory_gib allows {config.memory_gib:g} GiB"
    if here is not None and here < allowed:
        allowed, whose = here, f"this machine has {here / GIB:.1f} GiB"
    if needed > allowed:
        fits = int(allowed / (needed / capacity) * 0.98)
        raise SettingError(
            f"replay.capacity={config.capacity} needs {needed / GIB:.2f} GiB ({needed / capacity / 1000:.3g} kB a "
            f"transition); {whose}. Expected at most --set replay.capacity={fits}"
            + (", or a larger --set replay.memory_gib=…." if whose.startswith("replay") else ".")
        )


def machine_bytes() -> int | None:
    """Return the machine's memory in bytes; None where it does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None
