"""What a world adds to the report of a run, and how the user's own plots stand in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.analysis import page
from racecraft.analysis.own_plots import NoPlot

if TYPE_CHECKING:
    from racecraft.analysis.plot import Plot

LEARNING, EVALUATIONS = "learning", "evaluations"
"""Parts of every report behind which a world's own parts stand."""


@dataclass(frozen=True)
class PagePart:
    """A part of a report that a world brings."""

    heading: str
    body: Sequence[str]
    """Ready HTML, piece by piece."""
    behind: str = LEARNING
    """Of the report's own parts the one before it: LEARNING or EVALUATIONS."""

    def html(self) -> Iterator[str]:
        """Yield its pieces, the heading first."""
        yield f"<h2>{page.escaped(self.heading)}</h2>"
        yield from self.body


def own_plots_part(plots: Sequence[Plot | NoPlot]) -> Iterator[PagePart]:
    """Yield the part with the user's own plots, and why there are none where they failed; nothing without any."""
    if plots:
        yield PagePart("Your own", [_card(one) for one in plots], EVALUATIONS)


def _card(one: Plot | NoPlot) -> str:
    if isinstance(one, NoPlot):
        shown = f"<p>{page.escaped(one.why)}</p>"
    else:
        shown = page.photograph(one.without_title(), one.title, dpi=100)
    return page.card(f"<b>{page.escaped(one.title)}</b>{shown}")
