"""What an exporter of a world tells of the files that it wrote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Exported:
    """Written files, for programs and for people."""

    figures: Mapping[str, Any]
    """For `--json`: files, checkpoint, how they were checked."""
    lines: Sequence[str]
    """The same in sentences."""
