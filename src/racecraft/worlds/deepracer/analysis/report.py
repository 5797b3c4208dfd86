"""The parts that a car adds to a report: its laps, exits and actions. Begin with `report_parts`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from racecraft.analysis.custom_plots import NoPlot
from racecraft.analysis.figures import draw_curves
from racecraft.analysis.page import film as film_part
from racecraft.analysis.page import photograph
from racecraft.analysis.page_part import EVALUATIONS, PagePart, own_plots_part
from racecraft.analysis.plot import Plot
from racecraft.analysis.report import write_report
from racecraft.analysis.run_facts import RunFacts
from racecraft.analysis.video import film_title, small_film
from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.pages.parts import Bar, card, commands, details, grid, paragraph, source, table
from racecraft.worlds.deepracer.analysis import path_picture, tables
from racecraft.worlds.deepracer.analysis.drive import GRIEF, LAP_COMPLETE, WORDS, Drive, DriveError, incidents
from racecraft.worlds.deepracer.analysis.evaluations import track_table
from racecraft.worlds.deepracer.analysis.explaining import explain_failures
from racecraft.worlds.deepracer.analysis.failure_places import Why
from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps, headline, show_drive
from racecraft.worlds.deepracer.analysis.pace_part import first_full_lap, pace_parts
from racecraft.worlds.deepracer.analysis.run_advice import custom_plots_of
from racecraft.worlds.deepracer.analysis.run_facts import reward_of, track_of
from racecraft.worlds.deepracer.analysis.why_page import failure_parts
from racecraft.worlds.deepracer.files.generalisation import read_generalisation
from racecraft.worlds.deepracer.players.trained_car import KIND, TrainedCar, load_trained_car
from racecraft.worlds.deepracer.tracks.picture import draw_track
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

VIDEO, PATH_PICTURE, CURVES, REPORT = "lap.mp4", "path.png", "curves.png", "report.html"
WHY: dict[str, int] = {"starts": 12, "places": 2, "failures": 4, "seconds": 10}
"""How much is driven for the report's word on why it fails; `racecraft why` drives more."""
MAX_EXITS = 400
"""Crosses on the map of exits; the latest."""
MAX_TICKS = 2_000_000
"""Ticks read for the tables; of a longer run the latest."""


def paint_run(run: RunFolder, on_message: Callable[[str], None]) -> dict[str, Path]:
    """Film the best policy's lap, draw its path and the run's curves, write the report; return the files by kind."""
    on_message("Filming the best policy's lap …")
    car = load_trained_car(run.path, "best")
    drive = drive_laps(car, car.trained_on, laps=1)
    files = {
        "video": run.path / VIDEO,
        "picture": run.path / PATH_PICTURE,
        "curves": run.path / CURVES,
        "report": run.path / REPORT,
    }
    show_drive(drive, video=files["video"], picture=files["picture"], ghost=first_full_lap(run, car))
    draw_curves(files["curves"], run.read_metrics(), score_name=find_kind(KIND).score.name)
    why = explain_failures(car, car.trained_on, str(run.path), **WHY)
    film = small_film(files["video"])
    write_report(run, files["report"], of_world=lambda facts: car_parts(facts, drive.film_drive, film, why=why))
    return files


def report_parts(facts: RunFacts, plots: Sequence[Path]) -> Iterator[PagePart]:
    """Yield a car's parts; the best policy drives a lap for them.

    The film in the folder comes along where it is of that policy.

    Args:
        facts: Of the run.
        plots: Files, or folders of them, with the racer's own plots.

    Raises:
        RunFolderError: The run is no car's.
        CustomPlotError: A file holds no plot of the racer's own.
    """
    own = custom_plots_of(facts.run, plots)
    car = load_trained_car(facts.run.path, "best")
    drive = drive_laps(car, car.trained_on, laps=1).film_drive
    why = explain_failures(car, car.trained_on, str(facts.run.path), **WHY)
    yield from car_parts(facts, drive, _film_of(facts.run, car), own, why)


def _film_of(run: RunFolder, car: TrainedCar) -> bytes | None:
    """Return the film in the run folder, small, if it is of this very checkpoint; an older policy's tells nothing."""
    path = run.path / VIDEO
    return small_film(path) if path.is_file() and film_title(path) == headline(car) else None


def car_parts(
    facts: RunFacts,
    drive: Drive | None = None,
    film: bytes | None = None,
    own: Sequence[Plot | NoPlot] = (),
    why: Why | None = None,
) -> Iterator[PagePart]:
    """Yield a car's parts of a report.

    Args:
        facts: Of the run.
        drive: Of the best policy on the run's track, for the picture of a lap; None: the best training episode,
            exploration included.
        film: The same drive as a small MP4, which the page carries.
        own: The racer's own plots, and why there are none where they failed.
        why: Where the best policy fails; None: nothing is said of it.
    """
    ticks = tables.load_episodes(facts.run, MAX_TICKS)
    laps = ticks if ticks.is_empty() else tables.laps_table(ticks)
    track = track_of(facts.job)
    if track is not None and not (drive is None and laps.is_empty()):
        yield PagePart("On the track", list(_on_the_track(facts.title, track, ticks, laps, drive, film)))
    if track is not None:
        yield from pace_parts(facts, track, drive)
    if why is not None:
        command = commands([f"racecraft why {facts.run.path}"])
        yield PagePart("Why it fails", [*failure_parts(why), command])
    yield from _what_it_chose(ticks)
    yield from _reward(facts)
    yield from _track_by_track(facts.run)
    yield from own_plots_part(own)


def _on_the_track(
    title: str, track: Track, ticks: pl.DataFrame, laps: pl.DataFrame, drive: Drive | None, film: bytes | None
) -> Iterator[Markup]:
    """Yield the best lap, its film, and where and how episodes ended."""
    shown = drive or best_drive(ticks, laps)
    if shown is not None:
        words = path_picture.story("The best policy" if drive else "Best training episode", shown)
        slow, fast = path_picture.speed_limits(shown)
        speeds = f"Driven at {shown.driven_mps.mean():.2f} m/s on average; dark is {slow:.2f} m/s, bright {fast:.2f}."
        picture = photograph(path_picture.path_figure(track, shown, title), words)
        yield card(paragraph(words, "strong"), picture, paragraph(speeds, "quiet"))
    if drive is not None and film is not None:
        yield card(film_part(film, "A film of the best policy's lap: its view, a map, speed and steering"))
    if not laps.is_empty():
        yield from _exits_and_endings(track, laps)


def _what_it_chose(ticks: pl.DataFrame) -> Iterator[PagePart]:
    """Yield how often each command was chosen in training, and what it was paid."""
    if ticks.is_empty() or "action" not in ticks.columns:
        return
    counted = tables.action_table(ticks)
    speed = "speed (m/s)"
    if not counted.height:
        counted, speed = tables.command_table(ticks), "mean speed (m/s)"
    if not counted.height:
        return
    most = float(counted["share"].max() or 1.0)  # type: ignore[arg-type]
    rows = [
        (
            _chosen_words(row), f"{row['speed_mps']:.2f}", f"{100 * row['share']:.1f} %",
            Bar(row["share"] / most), f"{row['mean_reward']:.2f}",
        )
        for row in counted.iter_rows(named=True)
    ]  # fmt: skip
    heads = ("steering", speed, "share", "", "mean reward")
    note = paragraph("In training, exploration included.", "quiet")
    yield PagePart("What it chose", [card(table(heads, rows, (1, 2, 4)), note)])


def _reward(facts: RunFacts) -> Iterator[PagePart]:
    """Yield the reward function and what it paid."""
    reward = reward_of(facts.run)
    if not reward:
        return
    paid = [row["mean_reward"] for row in facts.metrics if row.get("mean_reward") is not None]
    pieces = [details("The reward function", source(reward))]
    if paid:
        text = f"An episode was paid {paid[-1]:.4g} in the mean of the last iteration that ended any."
        pieces.insert(0, paragraph(text))
    yield PagePart("What it was paid for", pieces)


def _track_by_track(run: RunFolder) -> Iterator[PagePart]:
    """Yield the latest evaluation track by track, where there are several."""
    by_track = track_table(read_generalisation(run.generalisation))
    if by_track is not None:
        part = card(table(by_track.heads, by_track.rows, (2, 3, 5)))
        yield PagePart("Track by track", [paragraph(by_track.description), part], EVALUATIONS)


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


def _exits_and_endings(track: Track, laps: pl.DataFrame) -> Iterator[Markup]:
    exits = laps.filter(laps["status"].cast(str).is_in(list(GRIEF)))
    where = f"Where cars {incidents(exits['status'].unique())}"
    if exits.height:
        latest = exits.tail(MAX_EXITS)
        figure = draw_track(track, number_every=10, title="")
        words = incidents(exits["status"].unique())
        path_picture.mark_exits(figure, latest.select("x_m", "y_m").to_numpy(), exits.height, words)
        times = "once" if exits.height == 1 else f"{exits.height:,} times"
        words = f"{times[0].upper()}{times[1:]}, a cross each"
        words += "." if latest.height == exits.height else f"; the latest {latest.height:,} are drawn."
        picture = photograph(figure, f"Map: {where.lower()}")
        yield card(paragraph(words), picture, head=f"{where} in training")
    endings = [
        (
            WORDS.get(row["status"], row["status"]), f"{row['count']:,}", f"{100 * row['share']:.1f} %",
            Bar(row["share"]),
        )
        for row in tables.endings_table(laps).iter_rows(named=True)
    ]  # fmt: skip
    worst = [
        (row["waypoint"], row["count"], f"{row['mean_speed_mps']:.2f}" if row["mean_speed_mps"] is not None else "–")
        for row in tables.exits_table(laps).head(8).iter_rows(named=True)
    ]
    heads: tuple[str, ...] = ("ending", "episodes", "share", "")
    cards = [card(table(heads, endings, (1, 2)), head=f"How {laps.height:,} training episodes ended")]
    if worst:
        heads = ("waypoint", "exits", "mean speed (m/s)")
        cards.append(card(table(heads, worst, (1, 2)), head=f"{where} most"))
    yield grid(*cards)
    first = laps["iteration"].min()
    if isinstance(first, int) and first > 1:
        yield paragraph(f"Maps and tables tell of iterations {first} and later.", "quiet")


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
