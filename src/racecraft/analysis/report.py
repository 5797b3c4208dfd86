"""A run on one web page that can be e-mailed: nothing on it is fetched from anywhere. Begin with `write_report`.

read what the folder holds → tiles → what was asked, what happened, what to try next → learning → on the track →
actions → evaluations → what it would have cost → settings, versions, meaning of the figures
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis import figures, page
from racecraft.analysis.account_words import asked_words, happened_words
from racecraft.analysis.advice import Advice
from racecraft.analysis.evaluations import judged, judged_by_track
from racecraft.analysis.metrics import METRICS
from racecraft.analysis.own_plots import NoPlot
from racecraft.analysis.plot import Plot
from racecraft.analysis.run_facts import RunFacts, read_facts
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.worlds.deepracer.analysis.drive import Drive, as_drive
from racecraft.worlds.deepracer.analysis.failure_places import Why
from racecraft.worlds.deepracer.analysis.report_parts import (
    on_the_track,
    what_it_chose,
    what_it_would_have_cost,
    why_it_fails,
)

if TYPE_CHECKING:
    import polars as pl


def write_report(
    run: RunFolder,
    path: str | Path,
    drive: Drive | Array | pl.DataFrame | None = None,
    film: bytes | None = None,
    advice: Sequence[Advice] = (),
    own: Sequence[Plot | NoPlot] = (),
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
        own: The racer's own plots, and why there are none where they failed.
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


def _parts(facts: RunFacts) -> Iterator[str]:
    """Yield the page from top to bottom."""
    yield from _headline(facts)
    yield from _account(facts)
    yield from _learning(facts)
    yield from on_the_track(facts)
    yield from why_it_fails(facts)
    yield from what_it_chose(facts)
    yield from _reward(facts)
    yield from _evaluations(facts)
    yield from _by_track(facts)
    yield from _own(facts)
    yield from what_it_would_have_cost(facts)
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
        (page.duration(last["seconds"]), "training time"),
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
            picture = page.details(plot.title, page.photograph(plot.without_title(), plot.title, dpi=90))
        lines = one.command.replace("RUN", facts.path).splitlines()
        command = f"<p>{'<br>'.join(f'<code>{page.escaped(line)}</code>' for line in lines)}</p>" if lines else ""
        yield page.card(f"<b>{page.escaped(one.try_)}</b><p>{page.escaped(one.found)}</p>{command}{picture}")


def _own(facts: RunFacts) -> Iterator[str]:
    if not facts.own:
        return
    yield "<h2>Your own</h2>"
    for one in facts.own:
        if isinstance(one, NoPlot):
            shown = f"<p>{page.escaped(one.why)}</p>"
        else:
            shown = page.photograph(one.without_title(), one.title, dpi=100)
        yield page.card(f"<b>{page.escaped(one.title)}</b>{shown}")


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


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(_plain(part) for part in value) or "none"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_plain(part)}" for name, part in value.items())
    return "none" if value is None else str(value)
