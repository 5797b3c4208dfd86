"""What to try next: a finding with its figures, a command and the plot that shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from racecraft.analysis.plot import Plot

GO_ON = "--resume --stop minutes=10"
"""How a command goes on with RUN; of a run of our own ten minutes after what it has had already."""


@dataclass(frozen=True)
class Advice:
    """A finding and what to try."""

    found: str
    """What the log shows, with figures."""
    try_: str
    """What to change, or to leave."""
    plot: Callable[[], Plot] | None = None
    """Makes the figure that shows it."""
    command: str = ""
    """What to type next; RUN stands for the run or log."""
