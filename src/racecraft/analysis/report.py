"""A run on one web page that can be e-mailed: nothing on it is fetched from anywhere. Begin with `write_report`.

read what the folder holds → tiles → what was asked, what happened, what to try next → learning → on the track →
actions → evaluations → what it would have cost → settings, versions, meaning of the figures
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis import figures, page, tables
from racecraft.analysis.deepracer.drive import LAP_COMPLETE, OFF_TRACK, WORDS, Drive, DriveError, as_drive
from racecraft.analysis.deepracer.failure_places import Why
from racecraft.analysis.deepracer.logs.advice import Advice
from racecraft.analysis.deepracer.logs.plot import Plot
from racecraft.analysis.deepracer.why_page import failure_parts
from racecraft.analysis.evaluations import judged, judged_by_track
from racecraft.analysis.metrics import METRICS
from racecraft.contract.errors import TrackError, UserInputError
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.generalisation import TrackResult, read_generalisation
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.tracks.catalogue import load_track
from racecraft.tracks.picture import draw_track
from racecraft.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

CONSOLE_USD_PER_HOUR = 3.50
"""What training on the AWS console cost."""
CONSOLE_STEPS_PER_SECOND = 8.0
"""What the original trains, everything in (facts: its own logs, 10,693 steps in 1,338 s)."""
MOST_TICKS = 2_000_000
"""Ticks read for the tables; of a longer run the latest."""
MOST_EXITS = 400
"""Crosses on the map of exits; the latest."""

SCORES = {
    "deepracer": ("progress (% of a lap)", "best checkpoint, mean progress"),
    "battlesnake": ("rating (Elo)", "best checkpoint, rating"),
}
RETURN = ("return (sum of rewards)", "best checkpoint, mean return")
"""What a run's scores and that of its best checkpoint are called, by its kind; RETURN is of all other kinds."""


class ReportError(UserInputError):
    """A report cannot be written of what the folder holds."""


@dataclass(frozen=True)
class RunFacts:
    """What a run folder tells, read once."""

    name: str
    job: dict[str, Any]
    metrics: list[dict[str, Any]]
    evaluations: list[dict[str, Any]]
    ticks: pl.DataFrame
    laps: pl.DataFrame
    track: Track | None
    """None where the run has none, or it is not the track of that name here."""
    drive: Drive | None = None
    """What the best policy drove, if somebody let it."""
    film: bytes | None = None
    """The same as a small film, an MP4."""
    best: int | None = None
    """Iteration of the best checkpoint, once one was evaluated."""
    reward: str = ""
    """The reward function's own text; "" where the run has none."""
    advice: Sequence[Advice] = ()
    """What to try next, computed from the run."""
    own: Sequence[Plot] = ()
    """The racer's own plots."""
    by_track: tuple[int, tuple[TrackResult, ...]] | None = None
    """The latest evaluation track by track, and its iteration, where there are several."""
    path: str = "RUN"
    """What a command calls the run."""
    why: Why | None = None
    """Where its best policy fails, and what would have saved it."""

    @property
    def best_row(self) -> dict[str, Any]:
        """The metrics of the best checkpoint's iteration; empty before any was evaluated."""
        return next((row for row in self.metrics if row.get("iteration") == self.best), {})

    @property
    def is_race(self) -> bool:
        """Cars were trained; scores are progress."""
        return self.kind == "deepracer"

    @property
    def kind(self) -> str:
        """What was trained, as job.json calls it."""
        return str(self.job.get("kind", "deepracer"))

    @property
    def score_name(self) -> str:
        """What the scores are, with their unit."""
        return SCORES.get(self.kind, RETURN)[0]

    @property
    def best_score_name(self) -> str:
        """What the best of them is called."""
        return SCORES.get(self.kind, RETURN)[1]

    @property
    def title(self) -> str:
        """The headline: the circuit, what else was trained, or the run's name."""
        return self.track.title or self.track.name if self.track else str(self.job.get("title", self.name))


def write_report(
    run: RunFolder,
    path: str | Path,
    drive: Drive | Array | pl.DataFrame | None = None,
    film: bytes | None = None,
    advice: Sequence[Advice] = (),
    own: Sequence[Plot] = (),
    why: Why | None = None,
) -> Path:
    """Write the page of a run.

    Args:
        run: The run folder; it may still be written to.
        path: The page, .html; it arrives whole.
        drive: Ticks of the best policy on the run's track, TICK_REPORT (T,) or as `as_drive` takes them, for the
            picture of a lap; None: the best training episode, exploration included.
        film: The same drive as a small MP4, which the page carries.
        advice: What to try next, with figure and command each.
        own: The racer's own plots.
        why: Where the best policy fails; None: nothing is said of it.

    Returns:
        The path.

    Raises:
        FigureError: The run has no metrics yet.
        ReportError: An evaluation is damaged.
        RunFolderError, EpisodeFileError: Another file is damaged.
        OutputFileError: The page cannot be written.
    """
    facts = read_facts(run, None if drive is None else as_drive(drive), film)
    facts = replace(facts, advice=advice, own=own, path=str(run.path), why=why)
    figures.require_metrics(facts.metrics)
    write_whole(path, page.page(f"{facts.title} – racecraft", _parts(facts)))
    return Path(path)


def read_facts(run: RunFolder, drive: Drive | None = None, film: bytes | None = None) -> RunFacts:
    """Read what a report tells of; `drive` is the lap to show, `film` shows it.

    Raises:
        ReportError: An evaluation is damaged.
        RunFolderError, EpisodeFileError: Another file is damaged.
    """
    job = run.read_job()
    ticks = tables.load_episodes(run, MOST_TICKS)
    return RunFacts(
        name=run.path.resolve().name,
        job=job,
        metrics=run.read_metrics(),
        evaluations=list(_read_evaluations(run)),
        ticks=ticks,
        laps=ticks if ticks.is_empty() else tables.laps_table(ticks),
        track=_track_of(job),
        drive=drive,
        film=film,
        best=_best_of(run),
        reward=_reward_of(run),
        by_track=read_generalisation(run.generalisation),
    )


def console_cost(steps: float) -> tuple[float, float]:
    """Return hours and US dollars that so many steps would have taken on the AWS console.

    hours = steps / CONSOLE_STEPS_PER_SECOND / 3600, dollars = hours x CONSOLE_USD_PER_HOUR.

    >>> console_cost(28_800)
    (1.0, 3.5)
    """
    hours = steps / CONSOLE_STEPS_PER_SECOND / 3600.0
    return hours, hours * CONSOLE_USD_PER_HOUR


def duration(seconds: float) -> str:
    """Return a time as a person says it.

    >>> duration(7.2), duration(95), duration(3.5 * 3600)
    ('7.2 s', '1 min 35 s', '3 h 30 min')
    """
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds // 60)} min {int(seconds % 60)} s"
    return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60)} min"


def _parts(facts: RunFacts) -> Iterator[str]:
    """Yield the page from top to bottom."""
    yield from _headline(facts)
    yield from _account(facts)
    yield from _learning(facts)
    yield from _on_the_track(facts)
    yield from _why(facts)
    yield from _actions(facts)
    yield from _reward(facts)
    yield from _evaluations(facts)
    yield from _by_track(facts)
    yield from _own(facts)
    yield from _cost(facts)
    yield from _small_print(facts)


def _headline(facts: RunFacts) -> Iterator[str]:
    asked, last = facts.job.get("asked", {}), facts.metrics[-1]
    said = [f"run {facts.name}", f"preset {asked['preset']}" if asked.get("preset") else ""]
    said += [
        str(facts.job.get("algorithm", "")),
        f"seed {facts.job['seed']}" if "seed" in facts.job else "",
        str(facts.job.get("started", "")),
    ]
    yield f"<h1>{page.escaped(facts.title)}</h1>"
    yield f'<p class="quiet">{page.escaped(" · ".join(part for part in said if part))}</p>'
    score, best_lap = facts.best_row.get("evaluation_score"), facts.best_row.get("best_lap_seconds")
    tiles = []
    if score is not None:
        tiles.append((f"{score:.1f} %" if facts.is_race else f"{score:.4g}", facts.best_score_name))
    if facts.is_race:
        tiles.append(
            (f"{best_lap:.2f} s" if best_lap else "none yet", "its best lap in evaluation" if best_lap else "best lap")
        )
    tiles += [
        (duration(last["seconds"]), "training time"),
        (f"{last['steps']:,}", "environment steps"),
        (f"{last['steps'] / last['seconds']:,.0f}/s" if last["seconds"] else "–", "steps a second, everything in"),
        (f"{sum(row.get('episodes') or 0 for row in facts.metrics):,}", "training episodes"),
    ]
    yield page.tiles(tiles)


def _account(facts: RunFacts) -> Iterator[str]:
    """Yield what was asked, what happened and what to try next, in plain words."""
    yield page.card("".join(f"<p>{page.escaped(one)}</p>" for one in (asked_words(facts), happened_words(facts))))
    if not facts.advice:
        return
    yield "<h2>What to try next</h2>"
    for one in facts.advice:
        picture = ""
        if one.plot is not None:
            plot = one.plot()
            picture = page.details(plot.title, page.photograph(plot.figure, plot.title, dpi=90))
        command = one.command.replace("RUN", facts.path)
        command = f"<p><code>{page.escaped(command)}</code></p>" if command else ""
        yield page.card(f"<b>{page.escaped(one.try_)}</b><p>{page.escaped(one.found)}</p>{command}{picture}")


def asked_words(facts: RunFacts) -> str:
    """Return a sentence that says what was asked."""
    asked = facts.job.get("asked", {})
    who = str(facts.job.get("algorithm", "a learner")).upper()
    stops = asked.get("stops") or asked.get("stop") or ()
    stops = [stops] if isinstance(stops, str) else list(stops)
    until = f", until {' or '.join(str(stop) for stop in stops)}" if stops else ""
    what = f"to drive {facts.title}" if facts.is_race else f"to play {facts.title}"
    return f"{who} was asked {what}{until}."


def happened_words(facts: RunFacts) -> str:
    """Return sentences that say what came of it: the first score, the best and the last."""
    last = facts.metrics[-1]
    told = f"It trained for {duration(last['seconds'])} and {last['steps']:,} steps."
    scored = [row for row in facts.metrics if row.get("evaluation_score") is not None]
    if not scored:
        return f"{told} It was not judged yet."
    best = max(scored, key=lambda row: row["evaluation_score"])
    unit = " % of a lap" if facts.is_race else ""
    first, top, now = (f"{row['evaluation_score']:.4g}{unit}" for row in (scored[0], best, scored[-1]))
    told += f" Judged without exploration it went from {first} to {top} in iteration {best['iteration']}"
    told += "." if best is scored[-1] else f"; the last judgement was {now}."
    laps = [row["best_lap_seconds"] for row in scored if row.get("best_lap_seconds")]
    return f"{told} Its fastest lap took {min(laps):.2f} s." if laps else told


def _own(facts: RunFacts) -> Iterator[str]:
    if not facts.own:
        return
    yield "<h2>Your own</h2>"
    for plot in facts.own:
        yield page.card(f"<b>{page.escaped(plot.title)}</b>{page.photograph(plot.figure, plot.title, dpi=100)}")


def _learning(facts: RunFacts) -> Iterator[str]:
    yield "<h2>How it learned</h2>"
    large = figures.Panel(facts.score_name, figures.LEARNING.curves, 0.0 if facts.is_race else None)
    if figures.has_values(facts.metrics, large):
        figure = figures.panel_figure(facts.metrics, large, 5.4, 3.5, size=12, steps_on_top=True)
        words = f"{facts.score_name} over training time, in training and evaluation"
        yield page.card(page.drawing(figure, words), "large")
    small = figures.small_panels(facts.metrics)
    drawn = (page.card(page.drawing(figures.panel_figure(facts.metrics, one), one.title)) for one in small)
    yield f'<div class="grid">{"".join(drawn)}</div>'


def _on_the_track(facts: RunFacts) -> Iterator[str]:
    if facts.track is None or (facts.drive is None and facts.laps.is_empty()):
        return
    yield "<h2>On the track</h2>"
    drive = facts.drive or best_drive(facts.ticks, facts.laps)
    if drive is not None:
        words = figures.story("The best policy" if facts.drive else "Best training episode", drive)
        slow, fast = figures.speed_limits(drive)
        speeds = f"Driven at {drive.driven_mps.mean():.2f} m/s on average; dark is {slow:.2f} m/s, bright {fast:.2f}."
        picture = page.photograph(figures.path_figure(facts.track, drive, facts.title), words)
        yield page.card(f'<p><b>{page.escaped(words)}</b></p>{picture}<p class="quiet">{speeds}</p>')
    if facts.drive is not None and facts.film is not None:
        yield page.card(page.film(facts.film, "A film of the best policy's lap: its view, a map, speed and steering"))
    if not facts.laps.is_empty():
        yield from _exits_and_endings(facts.track, facts.laps)


def _why(facts: RunFacts) -> Iterator[str]:
    if facts.why is None:
        return
    yield "<h2>Why it fails</h2>"
    yield from failure_parts(facts.why)
    yield f"<p><code>racecraft why {page.escaped(facts.path)}</code></p>"


def _exits_and_endings(track: Track, laps: pl.DataFrame) -> Iterator[str]:
    exits = laps.filter(laps["status"] == OFF_TRACK)
    if exits.height:
        shown = exits.tail(MOST_EXITS)
        figure = draw_track(track, number_every=10, title="Where cars left the road")
        figures.mark_exits(figure, shown.select("x_m", "y_m").to_numpy(), exits.height)
        times = "once" if exits.height == 1 else f"{exits.height:,} times"
        words = f"<p><b>Where cars left the road</b>: {times}, a cross each"
        words += "." if shown.height == exits.height else f"; the latest {shown.height:,} are drawn."
        yield page.card(f"{words}</p>{page.photograph(figure, 'Map of the places where cars left the road')}")
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
        cards += page.card("<b>Where cars left the road most</b>" + page.table(heads, worst, (1, 2)))
    yield f'<div class="grid" style="margin-top:12px">{cards}</div>'
    first = laps["iteration"].min()
    if isinstance(first, int) and first > 1:
        yield f'<p class="quiet">Maps and tables tell of iterations {first} and later.</p>'


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


def _actions(facts: RunFacts) -> Iterator[str]:
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


def _chosen_words(row: Mapping[str, Any]) -> str:
    if "steering_rad" in row:
        return _steering_words(row["steering_rad"])
    return f"{_steering_words(row['steering_low_rad'])} to {_steering_words(row['steering_high_rad'])}"


def _reward(facts: RunFacts) -> Iterator[str]:
    if not facts.reward:
        return
    yield "<h2>What it was paid for</h2>"
    paid = [row["mean_reward"] for row in facts.metrics if row.get("mean_reward") is not None]
    told = (
        f"<p>An episode was paid {paid[-1]:.4g} in the mean of the last iteration that ended any.</p>" if paid else ""
    )
    yield told + page.details("The reward function", page.source(facts.reward))


def _evaluations(facts: RunFacts) -> Iterator[str]:
    told = judged(facts.evaluations)
    if told is None:
        return
    yield "<h2>Evaluations</h2>"
    yield f"<p>{page.escaped(told.words)}</p>"
    yield page.card(page.table(told.heads, told.rows, told.numbers))


def _by_track(facts: RunFacts) -> Iterator[str]:
    told = judged_by_track(facts.by_track)
    if told is None:
        return
    yield "<h2>Track by track</h2>"
    yield f"<p>{page.escaped(told.words)}</p>"
    yield page.card(page.table(told.heads, told.rows, (2, 3, 5)))


def _cost(facts: RunFacts) -> Iterator[str]:
    if not facts.is_race:
        return
    last = facts.metrics[-1]
    hours, dollars = console_cost(last["steps"])
    yield "<h2>What it would have cost</h2>"
    steps_per_second = f"{CONSOLE_STEPS_PER_SECOND:g}"
    sum_ = f"{last['steps']:,} steps ÷ {steps_per_second} steps a second ÷ 3,600 = {hours:.2f} h"
    yield page.card(
        f"<p><b>{dollars:,.2f} USD</b> and <b>{duration(3600 * hours)}</b> on the AWS console; here it took "
        f"<b>{duration(last['seconds'])}</b>.</p>"
        f'<p class="quiet">{sum_}; {hours:.2f} h × {CONSOLE_USD_PER_HOUR:.2f} USD an hour. The console billed by the '
        f"hour of training; the original simulator trains {steps_per_second} steps a second, pauses for updates in, as "
        "its own logs show. Equal steps are compared, not equal skill; evaluations do not count as steps.</p>"
    )


def _small_print(facts: RunFacts) -> Iterator[str]:
    yield "<h2>Small print</h2>"
    settings = [
        (f"{group}.{name}", _plain(value))
        for group, values in facts.job.get("settings", {}).items()
        for name, value in values.items()
    ]
    if settings:
        yield page.details("Settings", page.table(("setting", "value"), settings))
    asked = [(name, _plain(value)) for name, value in facts.job.get("asked", {}).items()]
    asked += [(name, _plain(facts.job[name])) for name in ("seed", "threads", "started", "track") if name in facts.job]
    yield page.details("What was asked", page.table(("", ""), asked))
    versions = list(facts.job.get("versions", {}).items())
    if versions:
        yield page.details("Versions", page.table(("", ""), versions))
    present = [name for name in facts.metrics[-1] if name in METRICS]
    glossary = [(name, _plain(facts.metrics[-1][name]), METRICS[name]) for name in present]
    yield page.details("Figures of the last iteration", page.terms(glossary))


def _best_of(run: RunFolder) -> int | None:
    """Return the iteration of the checkpoint that the run calls best; None before any was evaluated."""
    checkpoints = Checkpoints(run.checkpoints)
    if not any(entry.score is not None for entry in checkpoints.entries()):
        return None
    return checkpoints.find("best").iteration


def _reward_of(run: RunFolder) -> str:
    """Return the text of the reward function, as far as it is text."""
    if not run.reward_function.is_file():
        return ""
    return run.reward_function.read_text(encoding="utf-8", errors="replace")


def _read_evaluations(run: RunFolder) -> Iterator[dict[str, Any]]:
    """Yield the evaluations by iteration."""
    paths = [path for path in run.evaluations.glob("*.json") if path.stem.isdigit()]
    for path in sorted(paths, key=lambda one: int(one.stem)):
        try:
            evaluation = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ReportError(
                f"{path}: cannot be read ({error}); expected an evaluation. Take the file out."
            ) from error
        if isinstance(evaluation, dict):
            yield {"iteration": int(path.stem), **evaluation}


def _track_of(job: Mapping[str, Any]) -> Track | None:
    """Return the circuit as it was driven, if it can be found and is the same."""
    told = job.get("track") or {}
    for name in (told.get("name"), (job.get("asked") or {}).get("track")):
        try:
            track = load_track(name) if name else None
        except TrackError:
            continue
        if track is not None and told.get("hash") in (None, track.hash()):
            is_reversed = job.get("settings", {}).get("race", {}).get("reverse", False)
            return track.reversed() if is_reversed else track
    return None


def _steering_words(angle: float) -> str:
    """Return a wheel angle as people say it.

    >>> _steering_words(0.5236), _steering_words(-0.1), _steering_words(0.0)
    ('30° left', '6° right', 'straight')
    """
    degrees = round(float(np.degrees(angle)))
    return "straight" if degrees == 0 else f"{abs(degrees)}° {'left' if degrees > 0 else 'right'}"


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(_plain(part) for part in value) or "none"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_plain(part)}" for name, part in value.items())
    return "none" if value is None else str(value)
