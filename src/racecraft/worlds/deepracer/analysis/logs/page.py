"""A log on one web page: what to change, episodes to choose from, every plot. Begin with `write_logs_page`.

The page is one file that works without a network: the data and the modules that show them stand in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from racecraft.analysis.advice import Advice
from racecraft.analysis.custom_plots import CustomPlot, NoPlot, made_or_why
from racecraft.analysis.page import figure_part
from racecraft.analysis.plot import Plot, PlotError
from racecraft.formats.atomic import write_atomic
from racecraft.pages.parts import (
    Heading,
    bullets,
    card,
    details,
    heading,
    named,
    page,
    paragraph,
    table,
    tiles,
    wide,
)  # fmt: skip
from racecraft.pages.render import render_part
from racecraft.worlds.deepracer.analysis.logs import (
    actions,
    evaluations,
    exits,
    fitting,
    heat,
    laps,
    motion,
    paths,
    progress,
    rescoring,
    rewards,
    rounds,
    scatter,
    sequences,
    step_times,
    straights,
    waypoints,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.judged import best_lap_seconds
from racecraft.worlds.deepracer.analysis.logs.page_data import page_data
from racecraft.worlds.deepracer.analysis.logs.segments import segments_plot
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

EXPLORER = "racecraft.worlds.deepracer.pages/logs_explorer.html"
MODULES = ("chart.js", "racecraft.worlds.deepracer.pages/logs.js")
STYLES = ("racecraft.worlds.deepracer.pages/logs.css",)
MAX_DAMAGE = 200

Pieces = Iterator[Heading | Markup]


@dataclass(frozen=True)
class Extras:
    """What may stand on a page beside the ticks."""

    damaged: tuple[str, ...] = ()
    """A line for each thing in the files that could not be taken."""
    metrics: pl.DataFrame | None = None
    """The table of AWS's metrics files."""
    reward: Callable[[dict[str, Any]], Any] | None = None
    """Another reward function, to be tried on the same laps."""
    plots: Sequence[CustomPlot] = ()
    """The racer's own plots."""
    advice: Sequence[Advice] = ()
    """What to change before the next training; `advice` finds it."""


def write_logs_page(
    path: str | Path,
    ticks: pl.DataFrame,
    track: Track | None,
    title: str,
    extras: Extras = Extras(),  # noqa: B008 (frozen)
) -> Path:
    """Write the page of a log.

    Args:
        path: The page, .html; it arrives whole.
        ticks: The table of `racecraft.worlds.deepracer.logs`.
        track: The circuit, turned as it was driven; None: what needs a map is left out, and that is said.
        title: Whose log it is.
        extras: What else shall stand on it.

    Returns:
        The path.

    Raises:
        PlotError: There are no ticks.
        OutputFileError: The page cannot be written.
    """
    where = f"{track.title or track.name}, {track.direction}" if track is not None else "an unknown track"
    about = f"{where} · {', '.join(ticks['phase'].cast(str).unique().sort())}"
    ticks = on_track(ticks, track) if track is not None else ticks  # once for all parts
    pieces = _parts(ticks, track, extras)
    write_atomic(path, page(title, pieces, about, f"{title} – logs", modules=MODULES, styles=STYLES))
    return Path(path)


def _parts(ticks: pl.DataFrame, track: Track | None, extras: Extras) -> Pieces:
    """Yield the page from top to bottom."""
    import polars as pl

    training = ticks.filter(pl.col("phase") == "training")
    main = training if training.height else ticks
    yield _headline(ticks, extras.metrics)
    yield from _advice(extras.advice)
    if track is not None:
        yield from _explorer(ticks, track)
    else:
        text = "No track of the catalogue fits this log, so maps are left out. Name it with --track."
        yield card(paragraph(text))
    yield from _section("How it learned", training, _learning())
    yield from _section("What the metrics files say", extras.metrics, _metrics())
    yield from _fastest_of_metrics(extras.metrics)
    yield from _section("On the track", main, _on_the_track(track))
    yield _table("endings", "How episodes ended", exits.endings(main))
    yield from _section("What it chose", main, _choices(track))
    yield from _section("What was paid", main, _paid(track, extras.reward))
    yield from _section("Laps and sectors", main, _laps(track))
    yield from _evaluations(ticks, track)
    yield from _own(ticks, track, extras.plots)
    yield from _damage(extras.damaged)


def _headline(ticks: pl.DataFrame, metrics: pl.DataFrame | None) -> Markup:
    episodes = simulation_agg(ticks)
    full = episodes.filter(episodes["complete"])
    workers = episodes.select("round", "worker").unique().height
    rounds = episodes["round"].n_unique()
    seconds = best_lap_seconds(episodes, metrics)
    best = "none yet" if seconds is None else f"{seconds:.2f} s"
    return tiles(
        [
            (best, "best full lap"),
            (f"{full.height:,} of {episodes.height:,}", "episodes that are full laps"),
            (f"{100 * episodes['progress_share'].to_numpy().mean():.0f} %", "mean progress"),
            (f"{ticks.height:,}", "steps"),
            (f"{episodes.select('round', 'iteration').unique().height:,}", "iterations"),
            (f"{workers:,}", "worker" if workers == 1 else "workers" if rounds == 1 else f"workers, {rounds} rounds"),
        ]
    )


def _advice(advice: Sequence[Advice]) -> Pieces:
    """Yield what to change, each with the figure that shows it, closed."""
    if not advice:
        return
    yield heading("Before the next training")
    for one in advice:
        plot = one.plot() if one.plot is not None else None
        figures = [] if plot is None else [details(plot.title, _figure(plot))]
        yield card(paragraph(one.found), *figures, head=one.try_)


def _explorer(ticks: pl.DataFrame, track: Track) -> Pieces:
    """Yield map, chart and list of episodes, which the page's module makes one."""
    data = page_data(ticks, track)
    yield heading("Choose episodes")
    yield render_part(EXPLORER, told=data, left_out=data["left_out"], shape=_shape(track))


def _shape(track: Track) -> str:
    """Return the map's width to its height, with the room that the script leaves around the road."""
    x0, y0, x1, y1 = track.bounds
    return f"{x1 - x0 + 1.2:.2f} / {y1 - y0 + 1.2:.2f}"


Made = Callable[[Any], Plot]


def _learning() -> list[Made]:
    return [
        progress.training_progress,
        scatter.quintiles,
        scatter.scatter_of_laps,
        lambda ticks: scatter.scatter_of_laps(ticks, complete=True),
        step_times.stability,
    ]


def _metrics() -> list[Made]:
    return [rounds.completion_progress, rounds.lap_time_progress, rounds.lap_scatter]


def _on_the_track(track: Track | None) -> list[Made]:
    if track is None:
        return []
    return [
        lambda ticks: heat.reward_heat_map(ticks, track),
        lambda ticks: exits.exit_points(ticks, track),
        lambda ticks: exits.exits_by_segment_plot(ticks, track),
        lambda ticks: paths.top_iterations(ticks, track),
        lambda ticks: paths.last_iteration(ticks, track),
        lambda ticks: fitting.fitted_line(ticks, track),
        lambda ticks: motion.slides(ticks, track),
        lambda _: segments_plot(track),
        lambda ticks: straights.straights_and_curves(ticks, track),
    ]


def _choices(track: Track | None) -> list[Made]:
    made: list[Made] = [actions.action_space, actions.action_histogram, sequences.action_sequences]
    if track is not None:
        made += [
            lambda ticks: actions.action_breakdown(ticks, track),
            lambda ticks: actions.action_index_map(ticks, track),
            lambda ticks: heat.action_heat_maps(ticks, track),
        ]
    return made


def _paid(track: Track | None, reward: Callable[[dict[str, Any]], Any] | None) -> list[Made]:
    made: list[Made] = [rewards.common_rewards, rewards.reward_distribution, rewards.discount_tester]
    if track is None:
        return made
    if reward is not None:
        made.insert(0, lambda ticks: rescoring.new_reward(ticks, track, reward))
    return [lambda ticks: waypoints.reward_per_waypoint(ticks, track), *made]


def _laps(track: Track | None) -> list[Made]:
    made: list[Made] = [laps.lap_times, laps.lap_correlations, motion.best_episode_distributions]
    if track is None:
        return made
    return [*made, lambda ticks: laps.sector_times(ticks, track), lambda ticks: laps.sector_losses(ticks, track)]


def _section(title: str, ticks: pl.DataFrame | None, made: list[Made]) -> Pieces:
    """Yield plots under a heading; those that the ticks do not carry are left out."""
    if ticks is None:
        return
    cards = []
    for make in made:
        try:
            plot = make(ticks)
        except PlotError:
            continue
        cards.append(_named(plot.name, card(_figure(plot), *_data(plot), head=plot.title)))
    if cards:
        yield heading(title)
        yield from cards


def _named(name: str, content: Markup) -> Markup:
    """Return a part of the page that a script or a test finds by the name of its plot or table."""
    return named(name, content)


def _table(name: str, title: str, frame: pl.DataFrame) -> Markup:
    """Return a table as a card."""
    heads = [column.replace("_", " ") for column in frame.columns]
    rows = [[_cell(value) for value in row] for row in frame.rows()]
    numbers = [k for k, kind in enumerate(frame.dtypes) if kind.is_numeric()]
    return _named(name, card(table(heads, rows, numbers), head=title))


def _fastest_of_metrics(metrics: pl.DataFrame | None) -> Pieces:
    """Yield the fastest laps that the metrics files tell of; they know evaluations whose steps nobody kept."""
    laps = None if metrics is None else rounds.metrics_best_laps(metrics)
    if laps is not None and laps.height:
        yield _table("metrics_best_laps", "Fastest laps, by the metrics files", laps)


def _figure(plot: Plot) -> Markup:
    """Return the figure; a picture keeps, on a narrow screen, a width at which it can be read."""
    return wide(figure_part(plot.without_title(), plot.title, dpi=100), plot.title)


def _data(plot: Plot) -> Iterator[Markup]:
    """Return the figures behind a plot, for those who want them; long tables are not on the page."""
    if plot.data.height > 40:
        return
    names = [name for name in plot.data.columns if name not in ("round", "phase", "stream", "master_iteration")][:12]
    rows = [[_cell(row[name]) for name in names] for row in plot.data.iter_rows(named=True)]
    numbers = [k for k, name in enumerate(names) if plot.data.schema[name].is_numeric()]
    yield details("Figures", table(names, rows, numbers))


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def _evaluations(ticks: pl.DataFrame, track: Track | None) -> Pieces:
    try:
        judged = evaluations.evaluation_table(ticks)
    except PlotError:
        return
    yield heading("Evaluations and submissions")
    heads = (
        "which",
        "lap",
        "progress",
        "time (s)",
        "distance (m)",
        "asked (m/s)",
        "driven (m/s)",
        "off track",
        "ended",
    )
    rows = [
        (
            f"{row['phase']} {row['stream']}", row["lap"], f"{100 * row['progress_share']:.1f} %",
            f"{row['seconds']:.3f}", f"{row['distance_m']:.2f}", f"{row['speed_mps']:.2f}", _cell(row["driven_mps"]),
            row["off_track"], "lap complete" if row["complete"] else str(row["status"]).replace("_", " "),
        )
        for row in judged.iter_rows(named=True)
    ]  # fmt: skip
    yield _named("evaluation_table", card(table(heads, rows, (1, 2, 3, 4, 5, 6, 7))))
    if track is not None:
        plot = evaluations.evaluation_grid(ticks, track)
        yield _named(plot.name, card(_figure(plot)))


def _own(ticks: pl.DataFrame, track: Track | None, own: Sequence[CustomPlot]) -> Pieces:
    """Yield the racer's own plots; one that fails says why, and the page stands."""
    cards = []
    for one in made_or_why(own, ticks, track):
        figures = [paragraph(one.why)] if isinstance(one, NoPlot) else [_figure(one), *_data(one)]
        cards.append(card(*figures, head=one.title))
    if cards:
        yield heading("Your own")
        yield from cards


def _damage(damaged: tuple[str, ...]) -> Pieces:
    if not damaged:
        return
    yield heading("What could not be read")
    more = [paragraph(f"and {len(damaged) - MAX_DAMAGE} more")] if len(damaged) > MAX_DAMAGE else []
    yield card(bullets(damaged[:MAX_DAMAGE], "code"), *more)
