"""What is asked of any training; each world adds its own words. Begin with `TrainRequest`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

DEFAULT_ALGORITHM = "ppo"


@dataclass(frozen=True, kw_only=True)
class TrainRequest:
    """What every training can be asked."""

    kind: ClassVar[str]
    """Which kind of world; the name of a `WorldKind`."""
    algorithm: str | None = None
    """What learns: a name of the registry, or "module:Class"; None: what the user's own files ask for, else
    DEFAULT_ALGORITHM."""
    stops: tuple[str, ...] = ()
    """As typed ("minutes=10"); none: the world's own."""
    run: Path | None = None
    """Run folder to make; None: the next number under runs/."""
    seed: int | None = None
    """Of everything; None: the world's own, 1 as a rule."""
    overrides: tuple[str, ...] = ()
    """group.name=value, as typed."""
    clone_from: str | None = None
    """RUN, RUN:best, RUN:last, RUN:N or a merit such as RUN:laptime, whose weights the training begins with; None:
    fresh weights."""
