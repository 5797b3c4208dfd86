"""Which worker carries which worlds, with which chance. Begin with `shares_of`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.training.partition import Block, Partitionable

SEED_APART = 7_368_787
"""Between the seeds of workers; the first has the training's own."""
BEGUN_APART = 1_000_003
"""Between the seeds of a worker's worlds each time that all are begun anew."""


@dataclass(frozen=True)
class Share:
    """What one worker carries."""

    index: int
    """Which worker, counted from 0."""
    blocks: tuple[Block, ...]
    """Which worlds of each part of the training's."""
    seed: int
    """Of its worlds and of exploration in them."""

    @property
    def num_worlds(self) -> int:
        """How many worlds it carries."""
        return sum(block.count for block in self.blocks)

    @property
    def bounds(self) -> Array:
        """Where each block begins among the share's own worlds, and where the last ends: int64 (parts + 1,)."""
        return np.cumsum([0, *(block.count for block in self.blocks)])

    @property
    def worlds(self) -> Array:
        """The numbers that its worlds have among all of the training's, int64 (num_worlds,)."""
        begins = np.cumsum([0, *(block.of for block in self.blocks)])
        return np.concatenate(
            [begin + block.first + np.arange(block.count) for begin, block in zip(begins, self.blocks, strict=False)]
        )

    def seed_of(self, times_begun: int) -> int:
        """Return the seed where all worlds were begun anew so often before."""
        return self.seed + BEGUN_APART * times_begun


def parts_of(planned: Any) -> tuple[int, ...]:
    """Return how many worlds each part of a plan has; a plan that says nothing of parts has one."""
    return planned.parts if isinstance(planned, Partitionable) else (planned.settings.rollout.num_worlds,)


def shares_of(parts: Sequence[int], workers: int, seed: int) -> list[Share]:
    """Share the worlds of every part out as evenly as can be; more workers than worlds are not asked.

    Who has one more of a part has been dealt to least until then, so that all have as many worlds as can be, too.

    >>> [share.num_worlds for share in shares_of((10,), 4, seed=1)]
    [3, 3, 2, 2]
    >>> [share.worlds.tolist() for share in shares_of((3, 4, 1), 3, seed=1)]
    [[0, 3, 4], [1, 5, 7], [2, 6]]
    """
    workers, turn = min(workers, sum(parts)), 0
    dealt: list[list[Block]] = [[] for _ in range(workers)]
    for worlds in parts:
        each, left = divmod(worlds, workers)
        first = 0
        for place, blocks in enumerate(dealt):
            count = each + ((place - turn) % workers < left)
            blocks.append(Block(first, count, worlds))
            first += count
        turn = (turn + left) % workers
    return [Share(place, tuple(blocks), seed + place * SEED_APART) for place, blocks in enumerate(dealt)]


def plan_of_share(planned: Any, share: Share) -> Any:
    """Return a training's plan with the worlds of one share: one thread, and no device beside the processor."""
    if isinstance(planned, Partitionable):
        planned = planned.of_blocks(share.blocks)
    settings = planned.settings
    settings = settings.with_group("rollout", replace(settings.rollout, num_worlds=share.num_worlds))
    settings = settings.with_group("runtime", replace(settings.runtime, threads=1, device="cpu"))
    return replace(planned, settings=settings)
