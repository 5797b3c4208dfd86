"""Settings of how experience is gathered."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting

UPDATES_BEFORE_GROWTH = 64
"""A horizon doubles once all ticks so far would be so many updates of twice its length."""


@dataclass(frozen=True)
class RolloutConfig:
    """How experience is gathered."""

    num_worlds: int = setting(32, "Worlds (cars) stepped side by side.", low=1, high=65536)
    horizon: int = setting(64, "Ticks taken from each world before one update.", unit="ticks", low=1)
    longest_horizon: int | None = setting(
        None,
        "With a number: updates learn from more as a training goes on. `horizon` doubles, as long as it stays within "
        f"this, whenever each world has driven {UPDATES_BEFORE_GROWTH} times as many ticks as it then has; one that is "
        "longer from the beginning stays.",
        unit="ticks",
        low=1,
    )
    episodes_per_iteration: int | None = setting(
        None,
        "With a number: an iteration is this many whole episodes, a fixed quota a world, instead of `horizon`.",
        low=1,
    )
    memory_steps: int | None = setting(
        None,
        "With a number: once the episodes of an iteration hold more ticks than this, the rest of them are not learned "
        "from.",
        unit="ticks",
        low=1,
    )

    def __post_init__(self) -> None:
        check_group(self)


def horizon_after(ticks_taken: int, horizon: int, longest: int | None) -> int:
    """Return how many ticks the next update learns from.

    >>> [horizon_after(ticks, 32, 128) for ticks in (0, 4095, 4096, 8192, 100_000)]
    [32, 32, 64, 128, 128]

    Args:
        ticks_taken: By each world so far.
        horizon: What a training begins with.
        longest: What it ends with, at most; None: it stays as it begins.
    """
    while longest is not None and 2 * horizon <= min(longest, ticks_taken // UPDATES_BEFORE_GROWTH):
        horizon *= 2
    return horizon
