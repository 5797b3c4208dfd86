"""AWS's two charts over our rows: what a game pays and how long it lasts, over minutes of training; and their page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis.figures import save_figure, small_axes
from racecraft.analysis.page import card, details, escaped, page, photograph, source, table
from racecraft.formats.reproduction import OLD, Moment, RowResult, best_over_old
from racecraft.formats.whole import write_whole
from racecraft.pages.colours import BLUE, GREEN, INK, ORANGE, QUIET, RED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LETTERS = 9.0
COLOURS = ("#7a4a9e", ORANGE, GREEN, BLUE, "#56b4e9", RED)
FLOORS = ((0, (1, 2)), (0, (5, 3)))
"""Line styles of what chance comes to."""

ALONE = 0.9
"""A training on one core that had less of it shared it with other work: it waits for nothing itself."""

Result = tuple[RowResult, Sequence[Moment]]


def chart_figure(results: Sequence[Result]) -> Figure:
    """Return both charts, one above the other; a band shows the standard error."""
    figure, upper = small_axes("mean reward of a game, all its snakes together", 8.6, 7.4, LETTERS)
    upper.set_position((0.07, 0.61, 0.91, 0.35))
    lower = figure.add_axes((0.07, 0.18, 0.91, 0.35))
    lower.set_title(
        "mean length of a game, turns, on a logarithmic scale", loc="left", fontsize=LETTERS, color=INK, pad=8
    )
    for side in ("top", "right", "left"):
        lower.spines[side].set_visible(False)
    lower.grid(axis="y", color=QUIET, alpha=0.25)
    lower.tick_params(labelsize=LETTERS - 1, colors=QUIET)
    _draw(upper, results, "reward")
    _draw(lower, results, "length")
    lower.set_yscale("log")
    lower.yaxis.set_major_formatter("{x:.0f}")
    lower.set_xlabel("minutes of training", fontsize=LETTERS, color=QUIET)
    handles, labels = lower.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(0.06, 0.0), ncols=2, frameon=False, fontsize=LETTERS - 1,
        labelcolor=INK,
    )  # fmt: skip
    return figure


def write_chart(path: Path, results: Sequence[Result]) -> Path:
    """Write the charts as a picture."""
    return save_figure(chart_figure(results), path, 130)


def table_lines(results: Sequence[Result]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return heads and rows of the table as words; ratios stand over the old trainer's row, where both are positive."""
    heads = (
        "row", "what", "cores", "had of them", "minutes", "steps", "steps/s", "reward", "length", "reward × old",
        "length × old",
    )  # fmt: skip
    old = next((row for row, _ in results if row.row == OLD), None)
    return heads, [_line(row, old) for row, _ in results]


def sentences(results: Sequence[Result]) -> list[str]:
    """Return what the chart comes to: the best rows over the old one, and whether other work ran meanwhile."""
    rows = [row for row, _ in results]
    told = [
        f"best over old, {one.among}: {one.row}, "
        f"{'no ratio of' if one.reward is None else f'{one.reward:.1f} times the'} reward, "
        f"{one.length:.1f} times the length"
        for one in best_over_old(rows)
    ]
    shared = [row for row in rows if row.cores == 1 and (row.processor_share or 1.0) < ALONE]
    if shared:
        had = ", ".join(f"{row.row} {row.processor_share:.0%}" for row in shared)
        told.append(f"other work ran meanwhile, of its one core a row had: {had}; compare rows of a machine at rest")
    return told


def write_page(path: Path, results: Sequence[Result], facts: Mapping[str, Any], commands: Mapping[str, str]) -> None:
    """Write the page.

    Args:
        path: An HTML file.
        results: Every row that is finished.
        facts: Words by name: what was asked, the machine.
        commands: What trains each row.
    """
    write_whole(path, page("AWS's snakes, made again", _parts(results, facts, commands)))


def _draw(axes: Any, results: Sequence[Result], what: str) -> None:
    trained = [(row, curve) for row, curve in results if curve]
    for (row, curve), colour in zip(trained, COLOURS, strict=False):
        minutes = [moment.minutes for moment in curve]
        means, errors = ([getattr(moment, name) for moment in curve] for name in (what, f"{what}_error"))
        axes.plot(minutes, means, color=colour, lw=1.8, marker="o", ms=3.5, label=row.title, clip_on=False)
        low, high = ([mean + sign * error for mean, error in zip(means, errors, strict=True)] for sign in (-1, 1))
        axes.fill_between(minutes, low, high, color=colour, alpha=0.15, lw=0)
    chance = [row for row, curve in results if not curve]
    for row, style in zip(chance, FLOORS, strict=False):
        axes.axhline(getattr(row, what), color=QUIET, lw=1.0, ls=style, label=row.title)
    axes.set_xlim(left=0.0)


def _line(row: RowResult, old: RowResult | None) -> tuple[str, ...]:
    trained = row.minutes is not None
    return (
        row.row,
        row.title,
        str(row.cores) if trained else "-",
        f"{row.processor_share:.0%}" if row.processor_share is not None else "-",
        f"{row.minutes:.2f}" if row.minutes is not None else "-",
        f"{row.steps:,}" if row.steps is not None else "-",
        f"{row.steps_per_second:,.0f}" if row.steps_per_second is not None else "-",
        f"{row.reward:.2f} ± {row.reward_error:.2f}",
        f"{row.length:.1f} ± {row.length_error:.1f}",
        _times(row.reward, old.reward) if old is not None else "-",
        _times(row.length, old.length) if old is not None else "-",
    )


def _times(mine: float, old: float) -> str:
    """Return a ratio; "-" where a sign makes it mean nothing."""
    return f"{mine / old:.1f}" if old > 0 and mine > 0 else "-"


def _parts(results: Sequence[Result], facts: Mapping[str, Any], commands: Mapping[str, str]) -> Iterator[str]:
    yield "<h1>AWS's snakes, made again</h1>"
    yield (
        "<p>Five snakes that share one policy; every row trains for the same minutes on this machine, one after the "
        "other. Checkpoints then play whole games, greedily, the same games for every row. A reward is what a game "
        "pays its five snakes together, and a length is its turns; ± is a standard error.</p>"
    )
    if results:
        yield card(photograph(chart_figure(results), "reward and length over minutes of training"))
    heads, lines = table_lines(results)
    yield "<h2>At the end of the training</h2>" + card(table(heads, lines, numbers=tuple(range(2, len(heads)))))
    for sentence in sentences(results):
        yield f"<p>{escaped(sentence)}</p>"
    yield "<h2>How to read it</h2>"
    for sentence in READING:
        yield f"<p>{escaped(sentence)}</p>"
    yield "<h2>Conditions</h2>" + card(table(("what", ""), [(name, str(value)) for name, value in facts.items()]))
    told = "".join(f"<h3>{escaped(name)}</h3>{source(command)}" for name, command in commands.items())
    yield "<h2>What was run</h2>" + details("commands", told)


READING = (
    "The ratio over the old row is the source's own measure. With rewards that may be negative it says little by "
    "itself, and a mask of walls and bodies alone, with nothing learned, takes games from about 4 turns to about 100: "
    "so the absolute figures stand beside it, and both floors.",
    "The source ran 210 minutes on 1 to 12 cores of several machines, each snake with a network of its own. Here all "
    "rows have one machine and few minutes, so they stand earlier on their curves.",
    "Heterogeneous means there a GPU for the learner and cores of other machines for the actors. Here the learner's "
    "thread has one core for itself and the actors the others; its core is no faster than theirs. Homogeneous means "
    "that both share all cores.",
    "The hand-written DQN is ours with the old script's figures: a memory of 5,000 drawn from evenly, one game at a "
    "time, a step of learning every 20 moves on 64, a target that follows by 0.001. MXNet's code itself is not run.",
)
