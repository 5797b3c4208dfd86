"""Settings of what is remembered and how it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class ReplayConfig:
    """What a learner remembers, and how it draws from that."""

    capacity: int = setting(100_000, "Transitions remembered; the oldest make room.", unit="transitions", low=1)
    learning_starts: int = setting(1000, "Nothing is learned before so many are remembered.", unit="transitions", low=1)
    prioritised: bool = setting(False, "Draw those oftener whose value was foreseen badly.")
    priority_exponent: float = setting(
        0.6, "How much oftener (alpha): 0 draws all alike, 1 in proportion to the error.", low=0.0, high=1.0
    )
    importance_exponent: float = setting(
        0.4, "How far that is weighed out in the loss at the beginning (beta); 1 wholly.", low=0.0, high=1.0
    )
    importance_steps: int = setting(
        100_000, "Transitions collected until it is weighed out wholly, in a straight line.", unit="transitions", low=1
    )
    memory_gib: float = setting(4.0, "A memory that needs more than this is refused.", unit="GiB", low=0.001)
    keep_mib: float = setting(
        16.0,
        "A memory of this size at most is kept in every checkpoint; of a larger one a resumed run begins anew.",
        unit="MiB",
        low=0.0,
    )

    def __post_init__(self) -> None:
        check_group(self)
