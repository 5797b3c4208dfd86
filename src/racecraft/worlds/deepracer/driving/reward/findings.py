"""What is found in a reward function: a fault, or a note worth knowing."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

FAULT, NOTE = "fault", "note"


@dataclass(frozen=True)
class Finding:
    """One thing that was found."""

    level: str
    """FAULT: it does not do what its author can have meant; NOTE: worth knowing."""
    kind: str
    """A word for programs: "raises", "unit", "trick" …"""
    text: str
    """What was found, in a sentence."""
    hint: str = ""
    """What to do about it."""
    line: int | None = None
    """Of the racer's file, counted from 1; None: of no single line."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return asdict(self)
