"""What a training came to. Imports neither torch nor a world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.formats.run_folder import RunFolder

if TYPE_CHECKING:
    from racecraft.training.loop import Outcome


@dataclass(frozen=True)
class Trained:
    """A training that ended, and where it lies."""

    kind: str
    run: RunFolder
    outcome: Outcome
    seed: int
    figures: Mapping[str, Any]
    """What `--json` prints of it."""

    def summary(self) -> dict[str, Any]:
        """Return the figures that `--json` prints."""
        return dict(self.figures)
