"""Transitions of R rows in a ring of ticks, each observation stored once. Begin with `TransitionRing`.

Tick t of row r lies in place `slot * R + r`, slot = t modulo the slots. What follows a tick is what is seen one slot
further, so nothing is stored twice; only an episode that was cut has a last observation that no slot shows, and those
few (`finals`) lie in a ring of their own. There is one slot more than ticks: it shows what is seen after the newest.

A story of n steps stops early, in this order:

* before a tick that is not to be learned from: value follows from what was seen there;
* with a tick that ended the episode: nothing follows (terminated), or value from its final observation (truncated).

What is drawn may be shown as stacks of the last k observations: what came before lies in the slots before, as far back
as the column `AGE` says that the episode reaches and the ring remembers.

Where a rollout does not begin with what the one before ended with (worlds begun anew, a resumed run), the rows that
differ count as cut there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import DTypeLike

from racecraft.algorithms.replay_sampler import Transitions
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.stacking import AGE, joined
from racecraft.contract.world import Array, ArraySpec, WorldSpec, mask_width
from racecraft.rollout.kernels.n_step import GOES_ON, NOBODY, TERMINATED, TRUNCATED, follow

FINAL_SHARE = 16
"""One tick in so many may have a final observation; with more, the oldest of those ticks are not learned from."""
SEEN, FINAL, COLUMN = "observations/", "finals/", "columns/"
"""Where arrays with names of their own stand among those of the ring."""


class TransitionRing:
    """The newest ticks of R rows.

    Args:
        spec: The world's promise; R = worlds times agents.
        ticks: How many are kept, 1 or more.
        columns: What else is kept of each transition.
        stack_size: k, how many observations what is drawn shows at once; more than 1 needs the column `AGE`.
    """

    def __init__(
        self, spec: WorldSpec, ticks: int, columns: Mapping[str, ArraySpec] | None = None, stack_size: int = 1
    ) -> None:
        self.stack_size = stack_size
        self.stacked = {name: part for name, part in spec.observations.items() if not part.privileged}
        """What is stacked, where anything is."""
        self.rows, self.ticks, self.slots = spec.num_worlds * spec.num_agents, ticks, ticks + 1
        layout = ring_layout(spec, ticks, columns or {})
        self.arrays = {name: np.zeros(shape, dtype) for name, (shape, dtype) in layout.items()}
        """All that is kept, by name: (slots, R, ...), those of the finals (F, ...)."""
        self.arrays["final_owner"][:] = NOBODY
        self._flat = {name: array.reshape(-1, *array.shape[2:]) for name, array in self.arrays.items()}
        """The same by place, (slots * R, ...); views, made once, as a batch asks for a dozen of them."""
        self._names = [name.removeprefix(SEEN) for name in self.arrays if name.startswith(SEEN)]
        self.head = 0
        """Ticks put in so far. Tick number `head` is yet to come; what it will begin with is seen already."""
        self.finals_put = 0

    @property
    def oldest(self) -> int:
        """Number of the oldest tick that is kept."""
        return max(0, self.head - self.ticks)

    def put(self, batch: RolloutBatch) -> Array:
        """Take in T ticks; the oldest make room. Of more than the ring holds, the newest are taken.

        Returns:
            Places that were to be learned from and no longer are, as their final observation had to make room, int64.
        """
        given_up = [self._mend_seam(batch)]
        skipped = max(0, batch.shape[0] - self.ticks)
        first, last = self.head + skipped, self.head + batch.shape[0]
        self.head = last
        end = np.where(batch.terminated, TERMINATED, np.where(batch.truncated, TRUNCATED, GOES_ON))
        columns = {
            **{SEEN + name: array for name, array in batch.observations.items()},
            **{COLUMN + name: array for name, array in batch.columns.items()},
            "actions": batch.actions,
            "reward": batch.reward,
            "active": batch.active,
            "end": end,
            "mask": batch.action_mask,
        }
        for name, array in columns.items():
            if array is not None and name in self.arrays:
                for slots, among in self._spans(first, last):
                    self.arrays[name][slots] = array[skipped:][among]
        self._show_next(batch)
        ticks, rows = np.divmod(batch.final_index, self.rows)
        kept = ticks >= skipped
        finals = {name: array[kept] for name, array in batch.final_observations.items()}
        given_up.append(self._keep_finals(last - batch.shape[0] + ticks[kept], rows[kept], finals))
        return np.concatenate(given_up)

    def places(self, first: int, last: int) -> Array:
        """Return the places of ticks first to last - 1, int64 (ticks * R,), in their order."""
        slots: Array = np.arange(first, last) % self.slots
        return (slots[:, None] * self.rows + np.arange(self.rows)).reshape(-1)

    def flat(self, name: str) -> Array:
        """Return an array by place, (slots * R, ...); a view."""
        return self._flat[name]

    def look_ahead(self, index: Array, n_step: int, discount: float) -> tuple[Array, Array, Array, Array]:
        """Follow the story from B places for n steps at most.

        Args:
            index: int64 (B,); n ticks from there on must have been put in.
            n_step: Steps at most, 1 or more.
            discount: Weight of the next tick (gamma).

        Returns:
            The discounted sum of rewards float32 (B,); gamma to the power of the steps, 0 where the story ended,
            float32 (B,); the place of what is seen then (B,); the last tick's place where the episode was cut, so that
            its final observation is meant, `NOBODY` elsewhere (B,).
        """
        count = len(index)
        total, weight = np.empty(count, np.float32), np.empty(count, np.float32)
        then, cut = np.empty(count, np.int64), np.empty(count, np.int64)
        follow(
            self.flat("reward"), self.flat("end"), self.flat("active"), np.ascontiguousarray(index, np.int64),
            self.rows, n_step, np.float32(discount), total, weight, then, cut,
        )  # fmt: skip
        return total, weight, then, cut

    def gather(self, index: Array, n_step: int, discount: float) -> Transitions:
        """Return the transitions in B places, all weights 1; see `look_ahead`."""
        total, weight, then, cut = self.look_ahead(index, n_step, discount)
        cuts = np.flatnonzero(cut != NOBODY)
        seen = {name: self.flat(SEEN + name).take(index, axis=0) for name in self._names}
        following = {name: self.flat(SEEN + name).take(then, axis=0) for name in self._names}
        if len(cuts):
            final = self.flat("final_at")[cut[cuts]]
            for name, array in following.items():
                array[cuts] = self.arrays[FINAL + name][final]
        if self.stack_size > 1:
            age = self._age(index)
            seen |= self._stacks(seen, index, age)
            last = self._before(then, 1)  # of the steps looked ahead: `then` is seen behind it
            following |= self._stacks(following, then, self._age(last) + 1)
        mask, next_mask = None, None
        if "mask" in self.arrays:
            mask, next_mask = self.flat("mask")[index], self.flat("mask")[then]
            next_mask[cuts] = True
        return Transitions(
            observations=seen,
            actions=self.flat("actions").take(index, axis=0),
            reward=total,
            discount=weight,
            next_observations=following,
            action_mask=mask,
            next_action_mask=next_mask,
            weights=np.ones(len(index), np.float32),
            index=index,
        )

    def state(self) -> dict[str, Array]:
        """Return what is kept, as named arrays (copies); what was never written is left out."""
        slots, finals = min(self.head + 1, self.slots), min(self.finals_put, len(self.arrays["final_owner"]))
        kept = {
            name: array[: finals if name.startswith("final") and name != "final_at" else slots].copy()
            for name, array in self.arrays.items()
        }
        return {**kept, "counts": np.array([self.head, self.finals_put])}

    def restore(self, state: Mapping[str, Array]) -> None:
        """Go on from what `state` gave; the ring must be of the same shape."""
        self.head, self.finals_put = (int(count) for count in state["counts"])
        for name, array in self.arrays.items():
            array[: len(state[name])] = state[name]

    def _age(self, places: Array) -> Array:
        """Return how many observations of the same episode came before and are remembered, k - 1 at most."""
        slots = places // self.rows
        remembered = (slots - self.oldest) % self.slots
        age: Array = np.minimum(self.flat(COLUMN + AGE).take(places), remembered)
        return age

    def _stacks(self, newest: Mapping[str, Array], places: Array, age: Array) -> dict[str, Array]:
        """Return stacks (B, ...) of what was seen before `places`, `age` observations of it, under the newest."""
        found = {}
        past = [np.minimum(back, age) for back in range(self.stack_size - 1, 0, -1)]
        for name, part in self.stacked.items():
            flat = self.flat(SEEN + name)
            frames = [flat.take(self._before(places, back), axis=0) for back in past]
            for frame, back in zip(frames, past, strict=True):
                frame[back == 0] = newest[name][back == 0]
            found[name] = joined(np.stack([*frames, newest[name]], axis=1), part)
        return found

    def _before(self, places: Array, ticks: int | Array) -> Array:
        """Return the places so many ticks earlier."""
        before: Array = (places - ticks * self.rows) % (self.slots * self.rows)
        return before

    def _spans(self, first: int, last: int) -> Iterator[tuple[slice, slice]]:
        """Yield where ticks first to last - 1 lie, in one piece or two: slots, and which of these ticks."""
        done = first
        while done < last:
            slot = done % self.slots
            count = min(last - done, self.slots - slot)
            yield slice(slot, slot + count), slice(done - first, done - first + count)
            done += count

    def _show_next(self, batch: RolloutBatch) -> None:
        """Write what is seen after the newest tick."""
        slot = self.head % self.slots
        for name, array in batch.last_observations.items():
            self.arrays[SEEN + name][slot] = array
        if batch.last_action_mask is not None:
            self.arrays["mask"][slot] = batch.last_action_mask

    def _mend_seam(self, batch: RolloutBatch) -> Array:
        """Let episodes count as cut that do not go on with what was seen last; return the places given up for it."""
        if not self.head:
            return np.zeros(0, np.int64)
        before, now = (self.head - 1) % self.slots, self.head % self.slots
        differs = np.zeros(self.rows, bool)
        for name, array in batch.observations.items():
            seen, shown = self.arrays[SEEN + name][now], np.ascontiguousarray(array[0])
            differs |= (_bytes(seen) != _bytes(shown)).any(axis=1)
        differs &= (self.arrays["end"][before] == GOES_ON) & self.arrays["active"][before]
        rows = np.flatnonzero(differs)
        self.arrays["end"][before, rows] = TRUNCATED
        finals = {name: self.arrays[SEEN + name][now, rows] for name in batch.observations}
        return self._keep_finals(np.full(len(rows), self.head - 1), rows, finals)

    def _keep_finals(self, ticks: Array, rows: Array, finals: Mapping[str, Array]) -> Array:
        """Keep the last observations of episodes that were cut (ticks rising); return the places given up for them."""
        owner, given_up = self.arrays["final_owner"], [np.zeros(0, np.int64)]
        for at in np.array_split(np.arange(len(ticks)), -(-len(ticks) // len(owner)) or 1):
            places = (self.finals_put + np.arange(len(at))) % len(owner)
            ousted = owner[places]
            ousted = ousted[ousted >= self.oldest * self.rows]
            given_up.append(ousted % (self.slots * self.rows))
            self.flat("active")[given_up[-1]] = False
            owner[places] = ticks[at] * self.rows + rows[at]
            self.arrays["final_at"][ticks[at] % self.slots, rows[at]] = places
            for name, array in finals.items():
                self.arrays[FINAL + name][places] = array[at]
            self.finals_put += len(at)
        return np.concatenate(given_up)


def ring_layout(
    spec: WorldSpec, ticks: int, columns: Mapping[str, ArraySpec]
) -> dict[str, tuple[tuple[int, ...], DTypeLike]]:
    """Return shape and type of every array of a ring, by name."""
    rows = spec.num_worlds * spec.num_agents
    kept, finals = (ticks + 1, rows), max(2 * rows, (ticks + 1) * rows // FINAL_SHARE)
    layout: dict[str, tuple[tuple[int, ...], DTypeLike]] = {
        "actions": ((*kept, *spec.actions.shape), spec.actions.dtype),
        "reward": (kept, np.float32),
        "end": (kept, np.uint8),
        "active": (kept, bool),
        "final_at": (kept, np.int32),
        "final_owner": ((finals,), np.int64),
    }
    if spec.has_action_mask:
        layout["mask"] = ((*kept, mask_width(spec)), bool)
    for name, part in spec.observations.items():
        layout[SEEN + name] = ((*kept, *part.shape), part.dtype)
        layout[FINAL + name] = ((finals, *part.shape), part.dtype)
    for name, part in columns.items():
        layout[COLUMN + name] = ((*kept, *part.shape), part.dtype)
    return layout


def ring_bytes(spec: WorldSpec, ticks: int, columns: Mapping[str, ArraySpec]) -> int:
    """Return the bytes that such a ring fills once it is full.

    >>> from racecraft.contract.world import DiscreteActions
    >>> camera = {"FRONT": ArraySpec((120, 160), np.uint8)}
    >>> ring_bytes(WorldSpec("car", 32, 1, camera, DiscreteActions(5)), 1000, {}) // 32_000
    20438
    """
    layout = ring_layout(spec, ticks, columns)
    return sum(math.prod(shape) * np.dtype(dtype).itemsize for shape, dtype in layout.values())


def _bytes(rows: Array) -> Array:
    """Return the bytes of each row, uint8 (R, ...): NaN equals itself there."""
    return np.ascontiguousarray(rows).reshape(len(rows), -1).view(np.uint8)
