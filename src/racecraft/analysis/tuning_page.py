"""What a search for settings found, as one web page: the best values, every trial, and what mattered."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from racecraft.analysis.figures import small_axes
from racecraft.analysis.page import figure_part
from racecraft.formats.atomic import write_atomic
from racecraft.formats.tuning import TrialRecord, TuningRecord
from racecraft.pages.colours import BLUE, INK, ORANGE, QUIET
from racecraft.pages.parts import Bar, Heading, card, grid, heading, page, paragraph, source, table, tiles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LETTERS = 9.0
_PAPER = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
"""Lies under words that stand where lines pass."""


def write_tuning_page(
    path: str | Path, record: TuningRecord, title: str, log_scale: Sequence[str], best_command: str
) -> None:
    """Write the page.

    Args:
        path: An HTML file.
        record: What was tried.
        title: Of the page.
        log_scale: Parameters that are drawn over their logarithm.
        best_command: What trains with the best values; "": nothing has a score.

    Raises:
        OutputFileError: It cannot be written.
    """
    aim = "largest" if record.maximise else "smallest"
    pieces = _parts(record, log_scale, best_command)
    write_atomic(path, page(title, pieces, f"looked for the {aim} {record.objective}"))


def _parts(facts: TuningRecord, log_scale: Sequence[str], best_command: str) -> Iterator[Heading | Markup]:
    best = facts.best
    counts = {state: sum(one.state == state for one in facts.trials) for state in ("complete", "pruned", "failed")}
    yield tiles(
        [
            ("-" if best is None else plain(best.score), f"best {facts.objective}"),
            (str(len(facts.trials)), "trials"),
            (str(counts["pruned"]), "given up early"),
            (str(counts["failed"]), "failed"),
        ]
    )
    if best is not None:
        yield heading("Train with the best values")
        yield paragraph(f"Trial {best.number}.")
        yield source(best_command)
        yield heading("Trial after trial")
        yield card(figure_part(history_figure(facts), "score of every trial, and the best so far"))
    if facts.importances:
        rows = [(name, words, Bar(share)) for name, words, share in facts.shares]
        yield heading("What mattered")
        yield card(
            table(("parameter", "share of the difference", ""), rows, numbers=(1,)),
            paragraph("How much of what tells good trials from others each parameter decides (PED-ANOVA).", "quiet"),
        )
    if len(facts.done) > 1:
        words = "one line a trial across every parameter, the better the darker"
        yield heading("All at once")
        yield card(figure_part(parallel_figure(facts, log_scale), words))
        yield heading("One by one")
        yield grid(
            *(
                card(figure_part(slice_figure(facts, name, name in log_scale), f"{facts.objective} over {name}"))
                for name in _names(facts)
            )
        )
    yield heading("Every trial")
    yield card(_table(facts))


def _table(facts: TuningRecord) -> Markup:
    heads = ("trial", facts.objective, "ended", "seconds", *_names(facts), "")
    rows = []
    for one in facts.trials:
        values = (plain(one.values.get(name)) for name in _names(facts))
        note = f"from {one.taken_from}" if one.taken_from else one.note
        rows.append((one.number, plain(one.score), one.state, plain(one.seconds), *values, note))
    return table(heads, rows, numbers=(0, 1, 3))


def history_figure(facts: TuningRecord) -> Figure:
    """Return the score of every trial that came to its end, and the best so far."""
    figure, axes = small_axes(facts.objective, 7.6, 2.6, LETTERS)
    numbers, scores, best = facts.best_so_far
    axes.scatter(numbers, scores, s=18, color=ORANGE, label="a trial")
    axes.step(numbers, best, where="post", color=BLUE, lw=1.6, label="best so far")
    axes.set_xlabel("trial", fontsize=LETTERS, color=QUIET)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.legend(frameon=False, fontsize=LETTERS - 1, labelcolor=INK)
    return figure


def parallel_figure(facts: TuningRecord, log_scale: Sequence[str]) -> Figure:
    """Return a line a trial across an upright axis a parameter, the score the last; the better the darker."""
    done = sorted(facts.done, key=lambda one: _goodness(facts, one))
    columns = [*_names(facts), facts.objective]
    figure, axes = small_axes("one line a trial, the better the darker", max(7.6, 1.5 * len(columns)), 3.2, LETTERS)
    scales = [_Scale([_of(one, name, facts) for one in done], name in log_scale) for name in columns]
    for rank, one in enumerate(done):
        share = (rank + 1) / len(done)
        heights = [scale.share(_of(one, name, facts)) for scale, name in zip(scales, columns, strict=True)]
        axes.plot(range(len(columns)), heights, color=BLUE, alpha=0.12 + 0.88 * share**3, lw=1.0 + share)
    for at, scale in enumerate(scales):
        axes.axvline(at, color=QUIET, lw=0.6)
        for height, text in scale.marks():
            axes.text(at + 0.02, height, text, fontsize=LETTERS - 2, color=INK, va="center", zorder=4, bbox=_PAPER)
    axes.set_xticks(range(len(columns)), columns, fontsize=LETTERS - 1)
    axes.set_yticks([])
    axes.set_xlim(-0.1, len(columns) - 0.7)
    return figure


def slice_figure(facts: TuningRecord, name: str, is_log: bool) -> Figure:
    """Return the score over one parameter."""
    figure, axes = small_axes(name, 3.6, 2.4, LETTERS)
    done = facts.done
    values = [one.values[name] for one in done]
    if not all(_is_number(value) for value in values):
        values = [str(value) for value in values]
    axes.scatter(values, [one.score for one in done], s=18, color=BLUE)
    if is_log:
        axes.set_xscale("log")
    axes.set_ylabel(facts.objective, fontsize=LETTERS - 1, color=QUIET)
    return figure


class _Scale:
    """One upright axis: where a value stands on it, 0 to 1."""

    def __init__(self, values: Sequence[Any], is_log: bool) -> None:
        self._is_log = is_log
        self._words = [] if all(_is_number(one) for one in values) else sorted({str(one) for one in values})
        numbers = [self._number(one) for one in values]
        self._low, self._high = min(numbers), max(numbers)

    def share(self, value: Any) -> float:
        if self._high == self._low:
            return 0.5
        return (self._number(value) - self._low) / (self._high - self._low)

    def marks(self) -> list[tuple[float, str]]:
        if self._words:
            return [(self.share(word), word) for word in self._words]
        ends = dict.fromkeys((self._low, self._high))
        return [(self.share(self._back(one)), plain(self._back(one))) for one in ends]

    def _number(self, value: Any) -> float:
        if self._words:
            return float(self._words.index(str(value)))
        return math.log(value) if self._is_log else float(value)

    def _back(self, number: float) -> float:
        return math.exp(number) if self._is_log else number


def plain(value: Any) -> str:
    """Return a value as a person writes it.

    >>> plain(0.000312345), plain(8), plain(None), plain("relu"), plain(12345.678)
    ('0.000312', '8', '-', 'relu', '12345.7')
    """
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)


def _names(facts: TuningRecord) -> list[str]:
    return list(facts.trials[0].values) if facts.trials else []


def _goodness(facts: TuningRecord, one: TrialRecord) -> float:
    return float(one.score or 0.0) * (1.0 if facts.maximise else -1.0)


def _of(one: TrialRecord, name: str, facts: TuningRecord) -> Any:
    return one.score if name == facts.objective else one.values[name]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
