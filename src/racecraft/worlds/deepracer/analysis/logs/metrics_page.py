"""Metrics files alone as a web page: progress, reward and lap times by episode. Begin with `write_metrics_page`.

A metrics file has a row an episode and not a step, so there is no path, no speed and no corner; the page says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from racecraft.formats.atomic import write_atomic
from racecraft.pages.chart import Chart, Series
from racecraft.pages.parts import Heading, bullets, card, chart, heading, page, paragraph, table, tiles
from racecraft.worlds.deepracer.analysis.logs.plot import few
from racecraft.worlds.deepracer.analysis.logs.rounds import FULL

if TYPE_CHECKING:
    import polars as pl

MISSING = (
    "Metrics files hold one row an episode. Path, speed, corners and actions are not in them; a simulation trace "
    "(.csv) or simulation log of the same training shows them."
)
LATEST = 20
"""Episodes in the mean of the reward and of the progress."""
MAX_POINTS = 2000
"""Episodes drawn; of more every second, third, …"""
MAX_LAPS = 20
EPISODE = "episode, in order"


def write_metrics_page(path: str | Path, metrics: pl.DataFrame, title: str, damaged: Sequence[str] = ()) -> Path:
    """Write the page of metrics files without a trace or log.

    Args:
        path: The page, .html; it arrives whole.
        metrics: `Logs.metrics`, at least one row.
        title: Whose they are.
        damaged: A line for each thing in the files that could not be read.

    Returns:
        The path.

    Raises:
        OutputFileError: The page cannot be written.
    """
    about = ", ".join(metrics["phase"].cast(str).unique().sort())
    write_atomic(path, page(title, _parts(metrics, damaged), about, f"{title} – metrics", modules=("chart.js",)))
    return Path(path)


def _parts(metrics: pl.DataFrame, damaged: Sequence[str]) -> Iterator[Heading | Markup]:
    """Yield the page from top to bottom."""
    import polars as pl

    rows = metrics.with_row_index("number", 1).with_columns(percent=100.0 * pl.col("progress_share"))
    laps = rows.filter(pl.col("progress_share") >= FULL)
    yield _headline(rows, laps)
    yield card(paragraph(MISSING))
    yield heading("Episode by episode")
    if rows["percent"].count():
        yield card(chart(_by_episode(rows, "percent", "Progress", "% of a lap", 100.0)))
    if rows["reward"].count():
        yield card(chart(_by_episode(rows, "reward", "Reward", "sum of the rewards")))
    if laps.height:
        dots = [_dots(laps, phase, "seconds") for phase in _phases(laps)]
        yield card(chart(Chart("Time of full laps", EPISODE, "s", dots)))
        yield card(_lap_table(laps), head="Fastest laps")
    if damaged:
        yield card(bullets(damaged, "code"), head="What could not be read")


def _headline(rows: pl.DataFrame, laps: pl.DataFrame) -> Markup:
    best: Any = laps["seconds"].min()
    progress: Any = rows["percent"].mean()
    return tiles(
        [
            ("none yet" if best is None else f"{best:.2f} s", "best full lap"),
            (f"{laps.height:,} of {rows.height:,}", "episodes that are full laps"),
            ("–" if progress is None else f"{progress:.0f} %", "mean progress"),
            (f"{rows.select('round', 'iteration').unique().height:,}", "iterations"),
        ]
    )


def _by_episode(rows: pl.DataFrame, column: str, title: str, unit: str, high: float | None = None) -> Chart:
    """Return a dot an episode, and a line that is the mean of the LATEST of a training."""
    import polars as pl

    series = [_dots(rows, phase, column) for phase in _phases(rows)]
    trained = rows.filter(pl.col("phase") == "training").with_columns(
        pl.col(column).rolling_mean(LATEST, min_samples=1)
    )
    if trained.height > 1:
        mean = few(trained, MAX_POINTS)
        series.append(Series(f"mean of {LATEST} episodes", mean["number"].to_list(), mean[column].to_list(), colour=3))
    return Chart(title, EPISODE, unit, series, low=0.0 if high else None, high=high)


def _phases(rows: pl.DataFrame) -> list[str]:
    return [phase for phase in ("training", "evaluation", "leaderboard") if (rows["phase"] == phase).any()]


def _dots(rows: pl.DataFrame, phase: str, column: str) -> Series:
    shown = few(rows.filter(rows["phase"] == phase), MAX_POINTS)
    colour = 1 if phase == "training" else 2
    return Series(phase, shown["number"].to_list(), shown[column].to_list(), "dots", colour=colour)


def _lap_table(laps: pl.DataFrame) -> Markup:
    fastest = laps.sort("seconds").head(MAX_LAPS).rows(named=True)
    heads = ("phase", "iteration", "episode", "time, s", "reward", "resets")
    cells = [
        (
            f"{row['phase']} {row['stream']}".strip(), row["iteration"], row["episode"] + 1,
            f"{row['seconds']:.2f}",
            *("–" if row[name] is None else f"{row[name]:,.0f}" for name in ("reward", "resets")),
        )
        for row in fastest
    ]  # fmt: skip
    return table(heads, cells, (1, 2, 3, 4, 5))
