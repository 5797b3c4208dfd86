"""The live display of a training, and its plain twin: one line an iteration where there is no terminal."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, TextIO

from racecraft.training.callbacks import EvaluationResult, IterationReport, TrainingCallback

if TYPE_CHECKING:
    from rich.console import Console, Group
    from rich.live import Live

ROWS = 12
"""Iterations shown at a time."""
SPARKS = " ▁▂▃▄▅▆▇█"


def watcher(stream: TextIO, *, wants_lines: bool = False) -> TrainingCallback:
    """Return the display that fits a stream: live on a terminal, else one line an iteration."""
    from rich.console import Console

    console = Console(file=stream)
    return LineWatcher(stream) if wants_lines or not console.is_terminal else LiveWatcher(console)


class LineWatcher:
    """One log line an iteration, for files, pipes and notebooks."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._score_name = "score"
        self._told = -1

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Say what is trained and when it stops."""
        self._score_name = score_name
        self._print(f"{title}; stops at {stops}")

    def iteration(self, report: IterationReport) -> None:
        """Print one line; of an iteration that is judged after all, when the training ends, only what that came to."""
        if report.iteration == self._told and report.result is not None:
            self._print(" | ".join([f"iteration {report.iteration}", *self._judged(report.result)]))
            return
        self._told = report.iteration
        parts = [
            f"iteration {report.iteration}",
            f"{report.seconds:.1f} s",
            f"{report.steps} steps",
            f"{report.steps_per_second:.0f} steps/s",
        ]
        scored = report.training_score is not None
        training = f"training {self._score_name} {number(report.training_score)}"
        parts.append(training if scored else f"{report.episodes} episodes ended")
        if tells_reward(self._score_name):
            parts.append(f"mean reward {number(report.mean_reward)}")
        if report.result is not None:
            parts += self._judged(report.result)
        self._print(" | ".join(parts))

    def _judged(self, result: EvaluationResult) -> list[str]:
        return [
            f"evaluation {self._score_name} {number(result.score)}",
            *([result.headline] if result.headline else []),
        ]

    def end(self, reason: str) -> None:
        """Print why it is over."""
        self._print(f"stopped: {reason}")

    def _print(self, line: str) -> None:
        print(line, file=self._stream, flush=True)


class LiveWatcher:
    """A table that grows in place: the latest iterations, a curve of the evaluations, the best of them."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._rows: deque[IterationReport] = deque(maxlen=ROWS)
        self._scores: deque[float] = deque(maxlen=60)
        self._best = ""
        self._title = self._stops = ""
        self._score_name = "score"

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Open the display."""
        from rich.live import Live

        self._title, self._stops, self._score_name = title, stops, score_name
        self._live = Live(self._picture(), console=self._console, auto_refresh=False, transient=False)
        self._live.start()

    def iteration(self, report: IterationReport) -> None:
        """Show one more row; an iteration that is judged after all, when the training ends, keeps its own."""
        if self._rows and self._rows[-1].iteration == report.iteration:
            self._rows.pop()
        self._rows.append(report)
        if report.result is not None:
            self._scores.append(report.result.score)
            self._best = report.result.headline if report.is_best else self._best
        if self._live is not None:
            self._live.update(self._picture(), refresh=True)

    def end(self, reason: str) -> None:
        """Close the display; the last picture stays on the screen."""
        if self._live is not None:
            self._live.update(self._picture(), refresh=True)
            self._live.stop()
            self._live = None
        self._console.print(f"stopped: {reason}", highlight=False)

    def _picture(self) -> Group:
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
        short = self._score_name
        has_headline = any(row.result is not None and row.result.headline for row in self._rows)
        scored = any(row.training_score is not None for row in self._rows)
        training = f"training {short}" if scored else "episodes"
        paid = tells_reward(self._score_name)
        titles = (
            "iteration",
            "seconds",
            "steps",
            "steps/s",
            training,
            *(["mean reward"] * paid),
            f"evaluation {short}",
        )
        for title in (*titles, *([""] * has_headline)):
            table.add_column(title, justify="right")
        for row in self._rows:
            result = row.result
            table.add_row(
                str(row.iteration),
                f"{row.seconds:.1f}",
                f"{row.steps:,}",
                f"{row.steps_per_second:,.0f}",
                number(row.training_score) if scored else str(row.episodes),
                *([number(row.mean_reward)] * paid),
                number(result.score) if result else "",
                *([result.headline if result else ""] * has_headline),
                style="green" if row.is_best else None,
            )
        best = f"   at its best: {self._best}" if self._best else ""
        heading = Text.assemble((self._title, "bold"), f"\nstops at {self._stops}; Ctrl-C saves and stops\n")
        return Group(heading, table, Text(f"\nevaluation {sparkline(list(self._scores))}{best}"))


def tells_reward(score_name: str) -> bool:
    """Tell whether episodes' rewards are worth a word beside their scores: not where the score is their sum itself."""
    return score_name != "return"


def number(value: float | None) -> str:
    """Return a score as text, a dash for none.

    >>> number(None), number(0.93), number(12.345), number(100.0)
    ('-', '0.93', '12.3', '100.0')
    """
    if value is None:
        return "-"
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"


def sparkline(values: list[float]) -> str:
    """Return a curve in one line of blocks, scaled from the smallest (or 0) to the largest value.

    >>> sparkline([0.0, 50.0, 100.0])
    ' ▄█'
    """
    if not values:
        return ""
    low, high = min(0.0, *values), max(values)
    span = (high - low) or 1.0
    return "".join(SPARKS[round((value - low) / span * (len(SPARKS) - 1))] for value in values)
