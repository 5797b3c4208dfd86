"""A log on one web page: what to change, episodes to choose from, every plot. Begin with `write_logs_page`.

The page is one file that works without a network: the data and a script of our own (`logs_page.js`) stand in it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis import page
from racecraft.analysis.advice import Advice
from racecraft.analysis.own_plots import CustomPlot, NoPlot, made_or_why
from racecraft.analysis.plot import Plot, PlotError
from racecraft.formats.atomic import write_atomic
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
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.page_data import page_data
from racecraft.worlds.deepracer.analysis.logs.segments import segments_plot
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

SCRIPT = Path(__file__).with_name("logs_page.js")
MOST_DAMAGE = 200
STYLE = """<style>
canvas { display: block; width: 100%; border-radius: 8px; touch-action: none; }
#map { height: auto; max-height: min(62vh, 560px); background: #fff; cursor: grab; }
#chart { height: 260px; touch-action: pan-y; cursor: pointer; }
.tools { display: flex; flex-wrap: wrap; gap: 8px; align-items: center; margin: 0 0 10px; }
.tools button, .tools select { font: inherit; padding: 4px 10px; border: 1px solid var(--line); border-radius: 8px;
  background: var(--ground); color: var(--ink); }
.tools input[type=range] { flex: 1 1 140px; min-width: 100px; }
#legend { display: flex; flex-wrap: wrap; gap: 8px; align-items: center; font-size: .9rem; margin-top: 8px; }
#legend i { width: 120px; height: 10px; border-radius: 5px; }
#told, #dot { min-height: 1.5em; font-variant-numeric: tabular-nums; }
#rows tr { cursor: pointer; } #rows td { white-space: nowrap; }
#rows tr.on td { background: var(--slot); font-weight: 600; }
.two { display: grid; gap: 12px; grid-template-columns: minmax(0, 1fr); margin-top: 12px; }
ol.advice li { margin: 10px 0; } ol.advice b { display: block; }
@media (max-width: 600px) { .plot { overflow-x: auto; } .plot img { width: 660px; max-width: none; } }
@media print { .tools, .list { display: none; } .card { break-inside: avoid; } h1, h2 { break-after: avoid; }
  body { background: #fff; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  #map, #chart { height: auto; max-height: none; aspect-ratio: auto !important; }
  details:not([open]) { display: none; } }
</style>"""


@dataclass(frozen=True)
class Extras:
    """What may stand on a page beside the ticks."""

    damaged: tuple[str, ...] = ()
    """A line for each thing in the files that could not be taken."""
    metrics: pl.DataFrame | None = None
    """The table of AWS's metrics files."""
    reward: Callable[[dict[str, Any]], Any] | None = None
    """Another reward function, to be tried on the same laps."""
    own: Sequence[CustomPlot] = ()
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
    parts = [STYLE, *_parts(ticks, track, title, extras)]
    write_atomic(path, page.page(f"{title} – logs", parts))
    return Path(path)


def _parts(ticks: pl.DataFrame, track: Track | None, title: str, extras: Extras) -> Iterator[str]:
    """Yield the page from top to bottom."""
    import polars as pl

    training = ticks.filter(pl.col("phase") == "training")
    main = training if training.height else ticks
    yield from _headline(ticks, track, title)
    yield from _advice(extras.advice)
    if track is not None:
        yield from _explorer(ticks, track)
    else:
        yield page.card("<p>No track of the catalogue fits this log, so maps are left out. Name it with --track.</p>")
    yield from _section("How it learned", training, _learning())
    yield from _section("What the metrics files say", extras.metrics, _metrics())
    yield from _fastest_of_metrics(extras.metrics)
    yield from _section("On the track", main, _on_the_track(track))
    yield _table("endings", "How episodes ended", exits.endings(main))
    yield from _section("What it chose", main, _choices(track))
    yield from _section("What was paid", main, _paid(track, extras.reward))
    yield from _section("Laps and sectors", main, _laps(track))
    yield from _evaluations(ticks, track)
    yield from _own(ticks, track, extras.own)
    yield from _damage(extras.damaged)


def _headline(ticks: pl.DataFrame, track: Track | None, title: str) -> Iterator[str]:
    episodes = simulation_agg(ticks)
    full = episodes.filter(episodes["complete"])
    where = f"{track.title or track.name}, {track.direction}" if track is not None else "an unknown track"
    yield f"<h1>{page.escaped(title)}</h1>"
    yield f'<p class="quiet">{page.escaped(where)} · {", ".join(ticks["phase"].cast(str).unique().sort())}</p>'
    workers = episodes.select("round", "worker").unique().height
    rounds = episodes["round"].n_unique()
    best = f"{full['seconds'].to_numpy().min():.2f} s" if full.height else "none yet"
    yield page.tiles(
        [
            (best, "best full lap"),
            (f"{full.height:,} of {episodes.height:,}", "episodes that are full laps"),
            (f"{100 * episodes['progress_share'].to_numpy().mean():.0f} %", "mean progress"),
            (f"{ticks.height:,}", "steps"),
            (f"{episodes.select('round', 'iteration').unique().height:,}", "iterations"),
            (f"{workers:,}", "worker" if workers == 1 else "workers" if rounds == 1 else f"workers, {rounds} rounds"),
        ]
    )


def _advice(told: Sequence[Advice]) -> Iterator[str]:
    """Yield what to change, each with the figure that shows it, closed."""
    if not told:
        return
    lines = []
    for one in told:
        plot = one.plot() if one.plot is not None else None
        shown = page.details(plot.title, _picture(plot)) if plot is not None else ""
        lines.append(f"<li><b>{page.escaped(one.try_)}</b>{page.escaped(one.found)}{shown}</li>")
    yield "<h2>Before the next training</h2>"
    yield page.card(f'<ol class="advice">{"".join(lines)}</ol>')


def _explorer(ticks: pl.DataFrame, track: Track) -> Iterator[str]:
    """Yield map, chart and list, and the script that makes them one."""
    data = page_data(ticks, track)
    left_out = data["left_out"]
    note = f" The steps of {left_out:,} slower or older episodes are not on this page." if left_out else ""
    yield "<h2>Choose episodes</h2>"
    yield page.card(
        '<div class="tools"><label>colour <select id="colour"><option value="driven_mps">driven speed</option>'
        '<option value="speed_mps">commanded speed</option><option value="reward">reward</option>'
        '<option value="steering_rad">steering</option><option value="slide_rad">slide</option></select></label>'
        '<button id="closer" aria-label="Zoom in">+</button><button id="farther" aria-label="Zoom out">−</button>'
        '<button id="whole">Whole track</button><button id="clear">Clear</button><button id="play">Play</button>'
        '<input id="step" type="range" min="0" max="1" value="0" aria-label="Step of the first chosen episode"></div>'
        f'<canvas id="map" style="aspect-ratio: {_shape(track)}" tabindex="0" role="img" '
        'aria-label="Map of the chosen episodes"></canvas>'
        '<div id="legend"></div><p id="told" aria-live="polite">Choose an episode.</p>'
        f"<small>Wheel or pinch to zoom, drag to move, point at a path to read it; + − 0 and arrow keys.{note}</small>"
    )
    yield '<div class="two">'
    yield page.card(
        '<div class="tools"><label>each episode\'s <select id="measure"><option value="progress_share">progress'
        '</option><option value="reward">reward</option><option value="seconds">time</option>'
        '<option value="steps">steps</option></select></label><button id="all-episodes">All episodes</button></div>'
        '<canvas id="chart" role="img" aria-label="A dot for each episode"></canvas><p id="dot" class="quiet"></p>'
        "<small>Green: full laps. Squares: evaluations. Click to choose, with Shift to add; wheel to zoom.</small>"
    )
    yield page.card(
        '<div class="tools"><label>order <select id="order"><option>fastest</option><option>farthest</option>'
        "<option>reward</option><option>latest</option><option>earliest</option></select></label>"
        '<label>show <select id="kind"><option>all</option><option value="full">full laps</option>'
        "<option>training</option><option>evaluation</option><option>leaderboard</option></select></label>"
        '<label><input id="several" type="checkbox"> several at once</label></div>'
        '<div class="scroll"><table><thead><tr><th>episode</th><th class="right">iteration</th>'
        '<th class="right">progress (%)</th><th class="right">time (s)</th>'
        '<th class="right">reward</th><th>ended</th></tr></thead>'
        '<tbody id="rows"></tbody></table></div>',
        "list",
    )
    yield "</div>"
    safe = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    yield f'<script type="application/json" id="log-data">{safe}</script>'
    yield f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>"


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


def _section(title: str, ticks: pl.DataFrame | None, made: list[Made]) -> Iterator[str]:
    """Yield plots under a heading; those that the ticks do not carry are left out."""
    if ticks is None:
        return
    cards = []
    for make in made:
        try:
            plot = make(ticks)
        except PlotError:
            continue
        cards.append(page.card(_named(plot.name, f"<b>{page.escaped(plot.title)}</b>{_picture(plot)}{_data(plot)}")))
    if cards:
        yield f"<h2>{title}</h2>"
        yield from cards


def _named(name: str, content: str) -> str:
    """Return a part of the page that a script or a test finds by the name of its plot or table."""
    return f'<div data-plot="{name}">{content}</div>'


def _table(name: str, title: str, table: pl.DataFrame) -> str:
    """Return a table as a card."""
    heads = [column.replace("_", " ") for column in table.columns]
    rows = [[_cell(value) for value in row] for row in table.rows()]
    numbers = [k for k, kind in enumerate(table.dtypes) if kind.is_numeric()]
    return page.card(_named(name, f"<b>{page.escaped(title)}</b>{page.table(heads, rows, numbers)}"))


def _fastest_of_metrics(metrics: pl.DataFrame | None) -> Iterator[str]:
    """Yield the fastest laps that the metrics files tell of; they know evaluations whose steps nobody kept."""
    laps = None if metrics is None else rounds.metrics_best_laps(metrics)
    if laps is not None and laps.height:
        yield _table("metrics_best_laps", "Fastest laps, by the metrics files", laps)


def _picture(plot: Plot) -> str:
    """Return the figure; on a narrow screen it keeps a width at which it can be read, and is pushed sideways."""
    return f'<div class="plot">{page.photograph(plot.without_title(), plot.title, dpi=100)}</div>'


def _data(plot: Plot) -> str:
    """Return the figures behind a plot, for those who want them; long tables are not on the page."""
    if plot.data.height > 40:
        return ""
    names = [name for name in plot.data.columns if name not in ("round", "phase", "stream", "master_iteration")][:12]
    rows = [[_cell(row[name]) for name in names] for row in plot.data.iter_rows(named=True)]
    numbers = [k for k, name in enumerate(names) if plot.data.schema[name].is_numeric()]
    return f"<details><summary>Figures</summary>{page.table(names, rows, numbers)}</details>"


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def _evaluations(ticks: pl.DataFrame, track: Track | None) -> Iterator[str]:
    try:
        table = evaluations.evaluation_table(ticks)
    except PlotError:
        return
    yield "<h2>Evaluations and submissions</h2>"
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
        for row in table.iter_rows(named=True)
    ]  # fmt: skip
    yield page.card(_named("evaluation_table", page.table(heads, rows, (1, 2, 3, 4, 5, 6, 7))))
    if track is not None:
        plot = evaluations.evaluation_grid(ticks, track)
        yield page.card(_named(plot.name, _picture(plot)))


def _own(ticks: pl.DataFrame, track: Track | None, own: Sequence[CustomPlot]) -> Iterator[str]:
    """Yield the racer's own plots; one that fails says why, and the page stands."""
    cards = []
    for one in made_or_why(own, ticks, track):
        shown = f"<p>{page.escaped(one.why)}</p>" if isinstance(one, NoPlot) else f"{_picture(one)}{_data(one)}"
        cards.append(page.card(f"<b>{page.escaped(one.title)}</b>{shown}"))
    if cards:
        yield "<h2>Your own</h2>"
        yield from cards


def _damage(damaged: tuple[str, ...]) -> Iterator[str]:
    if not damaged:
        return
    yield "<h2>What could not be read</h2>"
    lines = "".join(f"<li><code>{page.escaped(line)}</code></li>" for line in damaged[:MOST_DAMAGE])
    more = f"<p>and {len(damaged) - MOST_DAMAGE} more</p>" if len(damaged) > MOST_DAMAGE else ""
    yield page.card(f"<ul>{lines}</ul>{more}")
