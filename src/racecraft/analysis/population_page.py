"""How a population was trained, as one web page: who took over from whom, every member's settings, the best run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup

from racecraft.analysis.figures import small_axes
from racecraft.analysis.page import figure_part
from racecraft.analysis.tuning_page import plain
from racecraft.formats.atomic import write_atomic
from racecraft.formats.population import MemberRound, PopulationRecord
from racecraft.pages.colours import BLUE, INK, ORANGE, QUIET
from racecraft.pages.parts import Heading, card, heading, page, paragraph, source, table, tiles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LETTERS = 9.0


def write_population_page(path: str | Path, record: PopulationRecord, title: str, best_command: str) -> None:
    """Write the page.

    Args:
        path: An HTML file.
        record: The population as it stands.
        title: Of the page.
        best_command: What judges the best run; "": nobody has a score.

    Raises:
        OutputFileError: It cannot be written.
    """
    about = f"{record.size} members, {record.rounds} rounds"
    write_atomic(path, page(title, _parts(record, best_command), about))


def lineage_figure(record: PopulationRecord) -> Figure:
    """Return every member's score over the rounds; an orange line leads from whose weights were taken over."""
    figure, axes = small_axes(record.objective, 7.6, 3.4, LETTERS)
    scores = {(one.round, one.member): one.score for one in record.members}
    for one in record.members:
        begun_from = one.member if one.parent is None else one.parent
        here, before = scores[one.round, one.member], scores.get((one.round - 1, begun_from))
        if here is None:
            continue
        axes.plot([one.round], [here], "o", ms=4, color=BLUE if one.parent is None else ORANGE)
        axes.annotate(
            str(one.member), (one.round, here), textcoords="offset points", xytext=(5, 3), fontsize=LETTERS - 2,
            color=INK,
        )  # fmt: skip
        if before is not None:
            colour, width = (BLUE, 1.2) if one.parent is None else (ORANGE, 1.6)
            axes.plot([one.round - 1, one.round], [before, here], color=colour, lw=width)
    axes.set_xlabel("round", fontsize=LETTERS, color=QUIET)
    axes.xaxis.get_major_locator().set_params(integer=True)
    return figure


def ancestors(record: PopulationRecord, one: MemberRound) -> list[MemberRound]:
    """Return whom a member's weights come from, the oldest first, itself last."""
    line = [one]
    by_place = {(part.round, part.member): part for part in record.members}
    while line[0].round:
        first = line[0]
        line.insert(0, by_place[first.round - 1, first.member if first.parent is None else first.parent])
    return line


def _parts(record: PopulationRecord, best_command: str) -> Iterator[Heading | Markup]:
    best = record.best
    ended = [one for one in record.members if one.state]
    yield tiles(
        [
            ("-" if best is None else plain(best.score), f"best {record.objective}"),
            (str(len({one.round for one in ended})), f"of {record.rounds} rounds begun"),
            (str(sum(one.parent is not None for one in ended)), "times weights were taken over"),
            (str(sum(one.score is None for one in ended)), "failed"),
        ]
    )
    if best is not None:
        yield heading("The best")
        yield paragraph(f"Member {best.member} at the end of round {best.round}.")
        yield source(best_command)
        heads = ("round", "member", record.objective, *record.parameters)
        rows = [_row(record, one)[:3] + tuple(map(plain, _values(record, one))) for one in ancestors(record, best)]
        yield heading("Where its weights come from")
        yield card(table(heads, rows, numbers=(0, 1, 2)))
        yield heading("Round after round")
        yield card(figure_part(lineage_figure(record), "score of every member; orange: it took over another's weights"))
    heads = ("round", "member", record.objective, "weights of", "run", "seconds", *record.parameters, "")
    rows = [(*_row(record, one), *map(plain, _values(record, one)), one.note) for one in record.members]
    yield heading("Every member")
    yield card(table(heads, rows, numbers=(0, 1, 2, 5)))


def _row(record: PopulationRecord, one: MemberRound) -> tuple[str, ...]:
    parent = "its own" if one.parent is None else str(one.parent)
    return str(one.round), str(one.member), plain(one.score), parent, one.run, plain(one.seconds)


def _values(record: PopulationRecord, one: MemberRound) -> list[object]:
    return [one.values.get(name) for name in record.parameters]
