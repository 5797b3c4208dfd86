"""A run on one web page that can be e-mailed: nothing on it is fetched from anywhere. Begin with `write_report`.

read what the folder holds → tiles → what was asked, what happened, what to try next → learning → evaluations →
settings, versions, meaning of the figures; a world's own parts stand behind learning and behind the evaluations
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.analysis import figures, page
from racecraft.analysis.account import advice_of
from racecraft.analysis.advice import Advice
from racecraft.analysis.evaluations import return_table
from racecraft.analysis.metrics import METRICS
from racecraft.analysis.page_part import EVALUATIONS, LEARNING, PagePart
from racecraft.analysis.run_facts import RunFacts, read_facts
from racecraft.analysis.run_summary import asked_words, happened_words
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import RunFolder

Parts = Callable[[RunFacts], Iterable[PagePart]]


def write_report(run: RunFolder, path: str | Path, plots: Sequence[Path] = (), parts: Parts | None = None) -> Path:
    """Write the page of a run.

    Args:
        run: The run folder; it may still be written to.
        path: The page, .html; it arrives whole.
        plots: Files, or folders of them, with the user's own plots.
        parts: Makes the world's own parts; None: the run's kind of world makes them, and `plots`.

    Returns:
        The path.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        FigureError: The run has no metrics yet.
        ReportError: An evaluation is damaged.
        RunFolderError, EpisodeFileError: Another file is damaged.
        OwnPlotError: A file holds no plot of the user's own.
        OutputFileError: The page cannot be written.
    """
    facts = read_facts(run)
    figures.require_metrics(facts.metrics)
    own = list(_parts_of(facts, plots) if parts is None else parts(facts))
    write_atomic(path, page.page(f"{facts.title} – racecraft", _page(facts, own, advice_of(run))))
    return Path(path)


def _parts_of(facts: RunFacts, plots: Sequence[Path]) -> Iterable[PagePart]:
    of_world = facts.kind.piece("report_parts")
    found: Iterable[PagePart] = of_world(facts, plots) if of_world else ()
    return found


def _page(facts: RunFacts, own: Sequence[PagePart], advice: Sequence[Advice]) -> Iterator[str]:
    """Yield the page from top to bottom."""
    yield from _headline(facts)
    yield from _account(facts, advice)
    yield from _learning(facts)
    yield from _behind(LEARNING, own)
    yield from _evaluations(facts)
    yield from _behind(EVALUATIONS, own)
    yield from _small_print(facts)


def _behind(part: str, own: Sequence[PagePart]) -> Iterator[str]:
    for one in own:
        if one.behind == part:
            yield from one.html()


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
    score, called = facts.best_row.get("evaluation_score"), facts.kind.score
    tiles = [] if score is None else [(called.figure.format(score), called.best)]
    tiles += [
        *facts.world.tiles,
        (page.duration(last["seconds"]), "training time"),
        (f"{last['steps']:,}", "environment steps"),
        (f"{last['steps'] / last['seconds']:,.0f}/s" if last["seconds"] else "–", "steps a second, everything in"),
        (f"{sum(row.get('episodes') or 0 for row in facts.metrics):,}", "training episodes"),
    ]
    yield page.tiles(tiles)


def _account(facts: RunFacts, advice: Sequence[Advice]) -> Iterator[str]:
    """Yield what was asked, what happened and what to try next, in plain words."""
    yield page.card("".join(f"<p>{page.escaped(one)}</p>" for one in (asked_words(facts), happened_words(facts))))
    if not advice:
        return
    yield "<h2>What to try next</h2>"
    for one in advice:
        picture = ""
        if one.plot is not None:
            plot = one.plot()
            picture = page.details(plot.title, page.photograph(plot.without_title(), plot.title, dpi=90))
        lines = one.command.replace("RUN", str(facts.run.path)).splitlines()
        command = f"<p>{'<br>'.join(f'<code>{page.escaped(line)}</code>' for line in lines)}</p>" if lines else ""
        yield page.card(f"<b>{page.escaped(one.try_)}</b><p>{page.escaped(one.found)}</p>{command}{picture}")


def _learning(facts: RunFacts) -> Iterator[str]:
    yield "<h2>How it learned</h2>"
    score = facts.kind.score
    large = figures.Panel(score.name, figures.LEARNING.curves, score.lowest)
    if figures.has_values(facts.metrics, large):
        figure = figures.panel_figure(facts.metrics, large, 5.4, 3.5, size=12, steps_on_top=True)
        words = f"{score.name} over training time, in training and evaluation"
        yield page.card(page.drawing(figure, words), "large")
    small = figures.small_panels(facts.metrics)
    drawn = (page.card(page.drawing(figures.panel_figure(facts.metrics, one), one.title)) for one in small)
    yield f'<div class="grid">{"".join(drawn)}</div>'


def _evaluations(facts: RunFacts) -> Iterator[str]:
    of_world = facts.kind.piece("evaluation_table")
    told = (of_world(facts.evaluations) if of_world else None) or return_table(facts.evaluations)
    if told is None:
        return
    yield "<h2>Evaluations</h2>"
    yield f"<p>{page.escaped(told.words)}</p>"
    yield page.card(page.table(told.heads, told.rows, told.numbers))


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
