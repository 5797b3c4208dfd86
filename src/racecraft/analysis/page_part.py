"""What a world adds to the report of a run, and how the user's own plots stand in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup

from racecraft.analysis.custom_plots import NoPlot
from racecraft.analysis.page import figure_part
from racecraft.pages.parts import Heading, card, heading, paragraph

if TYPE_CHECKING:
    from racecraft.analysis.plot import Plot

LEARNING, EVALUATIONS = "learning", "evaluations"
"""Parts of every report behind which a world's own parts stand."""


@dataclass(frozen=True)
class PagePart:
    """A part of a report that a world brings."""

    heading: str
    body: Sequence[Markup]
    """Ready parts, piece by piece."""
    behind: str = LEARNING
    """Of the report's own parts the one before it: LEARNING or EVALUATIONS."""

    def pieces(self) -> Iterator[Heading | Markup]:
        """Yield its heading and its pieces."""
        yield heading(self.heading)
        yield from self.body


def own_plots_part(plots: Sequence[Plot | NoPlot]) -> Iterator[PagePart]:
    """Yield the part with the user's own plots, and why there are none where they failed; nothing without any."""
    if plots:
        yield PagePart("Your own", [_card(one) for one in plots], EVALUATIONS)


def _card(one: Plot | NoPlot) -> Markup:
    if isinstance(one, NoPlot):
        return card(paragraph(one.why), head=one.title)
    return card(figure_part(one.without_title(), one.title, dpi=100), head=one.title)
