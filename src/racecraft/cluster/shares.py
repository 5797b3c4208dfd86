"""Which worker carries which worlds, with which chance. Begin with `shares_of`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

SEED_APART = 7_368_787
"""Between the seeds of workers; the first has the training's own."""
BEGUN_APART = 1_000_003
"""Between the seeds of a worker's worlds each time that all are begun anew."""


@dataclass(frozen=True)
class Share:
    """What one worker carries."""

    place: int
    """Which worker, counted from 0."""
    num_worlds: int
    seed: int
    """Of its worlds and of exploration in them."""

    def seed_of(self, times_begun: int) -> int:
        """Return the seed where all worlds were begun anew so often before."""
        return self.seed + BEGUN_APART * times_begun


def shares_of(num_worlds: int, workers: int, seed: int) -> list[Share]:
    """Share worlds out as evenly as can be; more workers than worlds are not asked.

    >>> [share.num_worlds for share in shares_of(10, 4, seed=1)]
    [3, 3, 2, 2]
    """
    workers = min(workers, num_worlds)
    each, left = divmod(num_worlds, workers)
    return [Share(place, each + (place < left), seed + place * SEED_APART) for place in range(workers)]


def plan_of_share(planned: Any, share: Share) -> Any:
    """Return a training's plan with the worlds of one share: one thread, and no device beside the processor."""
    settings = planned.settings
    settings = settings.with_group("rollout", replace(settings.rollout, num_worlds=share.num_worlds))
    settings = settings.with_group("runtime", replace(settings.runtime, threads=1, device="cpu"))
    return replace(planned, settings=settings)
