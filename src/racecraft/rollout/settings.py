"""Settings of how experience is gathered."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class RolloutConfig:
    """How experience is gathered."""

    num_worlds: int = setting(32, "Worlds (cars) stepped side by side.", low=1, high=65536)
    horizon: int = setting(64, "Ticks taken from each world before one update.", unit="ticks", low=1)
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
