"""The parts of a report that only a car's has: its laps, its exits, its actions, its bill. See `analysis/report.py`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis import page
from racecraft.analysis.run_facts import RunFacts
from racecraft.worlds.deepracer.analysis import path_picture, tables
from racecraft.worlds.deepracer.analysis.drive import GRIEF, LAP_COMPLETE, WORDS, Drive, DriveError, what_befell
from racecraft.worlds.deepracer.analysis.why_page import failure_parts
from racecraft.worlds.deepracer.tracks.picture import draw_track
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

CONSOLE_USD_PER_HOUR = 3.50
"""What training on the AWS console cost."""
CONSOLE_STEPS_PER_SECOND = 8.0
"""What the original trains, everything in (facts: its own logs, 10,693 steps in 1,338 s)."""
MOST_EXITS = 400
"""Crosses on the map of exits; the latest."""


def on_the_track(facts: RunFacts) -> Iterator[str]:
    """Yield the best lap, its film, and where and how episodes ended; nothing without a track."""
    if facts.track is None or (facts.drive is None and facts.laps.is_empty()):
        return
    yield "<h2>On the track</h2>"
    drive = facts.drive or best_drive(facts.ticks, facts.laps)
    if drive is not None:
        words = path_picture.story("The best policy" if facts.drive else "Best training episode", drive)
        slow, fast = path_picture.speed_limits(drive)
        speeds = f"Driven at {drive.driven_mps.mean():.2f} m/s on average; dark is {slow:.2f} m/s, bright {fast:.2f}."
        picture = page.photograph(path_picture.path_figure(facts.track, drive, facts.title), words)
        yield page.card(f'<p><b>{page.escaped(words)}</b></p>{picture}<p class="quiet">{speeds}</p>')
    if facts.drive is not None and facts.film is not None:
        yield page.card(page.film(facts.film, "A film of the best policy's lap: its view, a map, speed and steering"))
    if not facts.laps.is_empty():
        yield from _exits_and_endings(facts.track, facts.laps)


def why_it_fails(facts: RunFacts) -> Iterator[str]:
    """Yield where the best policy fails, if somebody asked."""
    if facts.why is None:
        return
    yield "<h2>Why it fails</h2>"
    yield from failure_parts(facts.why)
    yield f"<p><code>racecraft why {page.escaped(facts.path)}</code></p>"


def what_it_chose(facts: RunFacts) -> Iterator[str]:
    """Yield how often each command was chosen in training, and what it was paid."""
    if facts.ticks.is_empty() or "action" not in facts.ticks.columns:
        return
    counted = tables.action_table(facts.ticks)
    speed = "speed (m/s)"
    if not counted.height:
        counted, speed = tables.command_table(facts.ticks), "mean speed (m/s)"
    if not counted.height:
        return
    most = float(counted["share"].max() or 1.0)  # type: ignore[arg-type]
    rows = [
        (
            _chosen_words(row), f"{row['speed_mps']:.2f}", f"{100 * row['share']:.1f} %",
            page.Bar(row["share"] / most), f"{row['mean_reward']:.2f}",
        )
        for row in counted.iter_rows(named=True)
    ]  # fmt: skip
    yield "<h2>What it chose</h2>"
    heads = ("steering", speed, "share", "", "mean reward")
    yield page.card(page.table(heads, rows, (1, 2, 4)) + "<small>In training, exploration included.</small>")


def what_it_would_have_cost(facts: RunFacts) -> Iterator[str]:
    """Yield what as many steps took and cost on the AWS console."""
    if not facts.is_race:
        return
    last = facts.metrics[-1]
    hours, dollars = console_cost(last["steps"])
    yield "<h2>What it would have cost</h2>"
    steps_per_second = f"{CONSOLE_STEPS_PER_SECOND:g}"
    sum_ = f"{last['steps']:,} steps ÷ {steps_per_second} steps a second ÷ 3,600 = {hours:.2f} h"
    yield page.card(
        f"<p><b>{dollars:,.2f} USD</b> and <b>{page.duration(3600 * hours)}</b> on the AWS console; here it took "
        f"<b>{page.duration(last['seconds'])}</b>.</p>"
        f'<p class="quiet">{sum_}; {hours:.2f} h × {CONSOLE_USD_PER_HOUR:.2f} USD an hour. The console billed by the '
        f"hour of training; the original simulator trains {steps_per_second} steps a second, pauses for updates in, as "
        "its own logs show. Equal steps are compared, not equal skill; evaluations do not count as steps.</p>"
    )


def console_cost(steps: float) -> tuple[float, float]:
    """Return hours and US dollars that so many steps would have taken on the AWS console.

    hours = steps / CONSOLE_STEPS_PER_SECOND / 3600, dollars = hours x CONSOLE_USD_PER_HOUR.

    >>> console_cost(28_800)
    (1.0, 3.5)
    """
    hours = steps / CONSOLE_STEPS_PER_SECOND / 3600.0
    return hours, hours * CONSOLE_USD_PER_HOUR


def best_drive(ticks: pl.DataFrame, laps: pl.DataFrame) -> Drive | None:
    """Return the fastest full lap among the episodes seen whole, else the one that came furthest; None without any."""
    import polars as pl

    whole = laps.filter(pl.col("whole") & (pl.col("ticks") > 2))
    full = whole.filter(pl.col("status") == LAP_COMPLETE).sort("lap_seconds")
    ranked = full if full.height else whole.sort("progress_percent", descending=True)
    if not ranked.height:
        return None
    best = ranked.row(0, named=True)
    car = pl.col("world") == best["world"] if "world" in ticks.columns else pl.lit(True)
    try:
        return Drive.from_episodes(ticks.filter(car & (pl.col("episode") == best["episode"])))
    except DriveError:
        return None  # files of others may lack what a drive is made of


def _exits_and_endings(track: Track, laps: pl.DataFrame) -> Iterator[str]:
    exits = laps.filter(laps["status"].cast(str).is_in(list(GRIEF)))
    where = f"Where cars {what_befell(exits['status'].unique())}"
    if exits.height:
        shown = exits.tail(MOST_EXITS)
        figure = draw_track(track, number_every=10, title="")
        words = what_befell(exits["status"].unique())
        path_picture.mark_exits(figure, shown.select("x_m", "y_m").to_numpy(), exits.height, words)
        times = "once" if exits.height == 1 else f"{exits.height:,} times"
        words = f"<p><b>{where} in training</b>: {times}, a cross each"
        words += "." if shown.height == exits.height else f"; the latest {shown.height:,} are drawn."
        yield page.card(f"{words}</p>{page.photograph(figure, f'Map: {where.lower()}')}")
    endings = [
        (
            WORDS.get(row["status"], row["status"]), f"{row['count']:,}", f"{100 * row['share']:.1f} %",
            page.Bar(row["share"]),
        )
        for row in tables.endings_table(laps).iter_rows(named=True)
    ]  # fmt: skip
    worst = [
        (row["waypoint"], row["count"], f"{row['mean_speed_mps']:.2f}" if row["mean_speed_mps"] is not None else "–")
        for row in tables.exits_table(laps).head(8).iter_rows(named=True)
    ]
    cards = page.card(
        f"<b>How {laps.height:,} training episodes ended</b>"
        + page.table(("", "episodes", "share", ""), endings, (1, 2))
    )
    if worst:
        heads = ("waypoint", "exits", "mean speed (m/s)")
        cards += page.card(f"<b>{where} most</b>" + page.table(heads, worst, (1, 2)))
    yield f'<div class="grid" style="margin-top:12px">{cards}</div>'
    first = laps["iteration"].min()
    if isinstance(first, int) and first > 1:
        yield f'<p class="quiet">Maps and tables tell of iterations {first} and later.</p>'


def _chosen_words(row: Mapping[str, Any]) -> str:
    if "steering_rad" in row:
        return _steering_words(row["steering_rad"])
    return f"{_steering_words(row['steering_low_rad'])} to {_steering_words(row['steering_high_rad'])}"


def _steering_words(angle: float) -> str:
    """Return a wheel angle as people say it.

    >>> _steering_words(0.5236), _steering_words(-0.1), _steering_words(0.0)
    ('30° left', '6° right', 'straight')
    """
    degrees = round(float(np.degrees(angle)))
    return "straight" if degrees == 0 else f"{abs(degrees)}° {'left' if degrees > 0 else 'right'}"
