"""A run on one web page that can be e-mailed: nothing on it is fetched from anywhere. Begin with `write_report`.

read what the folder holds → tiles → what was asked, what happened, what to try next → learning → evaluations →
what it would have cost on AWS → settings, versions, meaning of the figures; a world's own parts stand behind learning
and behind the evaluations
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from racecraft.analysis import figures
from racecraft.analysis.advice import Advice
from racecraft.analysis.aws_cost import cost_part
from racecraft.analysis.evaluations import return_table
from racecraft.analysis.metrics import METRICS
from racecraft.analysis.page import figure_part
from racecraft.analysis.page_part import EVALUATIONS, LEARNING, PagePart
from racecraft.analysis.run_advice import advice_of
from racecraft.analysis.run_facts import RunFacts, read_facts
from racecraft.analysis.run_summary import happened_words, request_text
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import RunFolder
from racecraft.pages import parts
from racecraft.pages.filters import duration
from racecraft.pages.parts import Heading

Pieces = Iterator[Heading | Markup]
Parts = Callable[[RunFacts], Iterable[PagePart]]


def write_report(run: RunFolder, path: str | Path, plots: Sequence[Path] = (), of_world: Parts | None = None) -> Path:
    """Write the page of a run.

    Args:
        run: The run folder; it may still be written to.
        path: The page, .html; it arrives whole.
        plots: Files, or folders of them, with the user's own plots.
        of_world: Makes the world's own parts; None: the run's kind of world makes them, and `plots`.

    Returns:
        The path.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        FigureError: The run has no metrics yet.
        ReportError: An evaluation is damaged.
        RunFolderError, EpisodeFileError: Another file is damaged.
        CustomPlotError: A file holds no plot of the user's own.
        OutputFileError: The page cannot be written.
    """
    facts = read_facts(run)
    figures.require_metrics(facts.metrics)
    own = list(_parts_of(facts, plots) if of_world is None else of_world(facts))
    write_atomic(path, parts.page(facts.title, _page(facts, own, advice_of(run)), _about(facts)))
    return Path(path)


def _parts_of(facts: RunFacts, plots: Sequence[Path]) -> Iterable[PagePart]:
    of_world = facts.kind.piece("report_parts")
    found: Iterable[PagePart] = of_world(facts, plots) if of_world else ()
    return found


def _page(facts: RunFacts, own: Sequence[PagePart], advice: Sequence[Advice]) -> Pieces:
    """Yield the page from top to bottom."""
    yield from _headline(facts)
    yield from _account(facts, advice)
    yield from _learning(facts)
    yield from _behind(LEARNING, own)
    yield from _evaluations(facts)
    yield from _behind(EVALUATIONS, own)
    yield from cost_part(facts).pieces()
    yield from _small_print(facts)


def _behind(part: str, own: Sequence[PagePart]) -> Pieces:
    for one in own:
        if one.behind == part:
            yield from one.pieces()


def _about(facts: RunFacts) -> str:
    """Return what run it is, for the line below the title."""
    request = facts.job.get("asked", {})
    sentences = [
        f"run {facts.name}",
        f"preset {request['preset']}" if request.get("preset") else "",
        str(facts.job.get("algorithm", "")),
        f"seed {facts.job['seed']}" if "seed" in facts.job else "",
        str(facts.job.get("started", "")),
    ]
    return " · ".join(part for part in sentences if part)


def _headline(facts: RunFacts) -> Pieces:
    last = facts.metrics[-1]
    score, called = facts.best_row.get("evaluation_score"), facts.kind.score
    tiles = [] if score is None else [(called.figure.format(score), called.best)]
    tiles += [
        *facts.world.tiles,
        (duration(last["seconds"]), "training time"),
        (f"{last['steps']:,}", "environment steps"),
        (f"{last['steps'] / last['seconds']:,.0f}/s" if last["seconds"] else "–", "steps a second, everything in"),
        (f"{sum(row.get('episodes') or 0 for row in facts.metrics):,}", "training episodes"),
    ]
    yield parts.tiles(tiles)


def _account(facts: RunFacts, advice: Sequence[Advice]) -> Pieces:
    """Yield what was asked, what happened and what to try next, in plain words."""
    yield parts.card(parts.paragraph(request_text(facts)), parts.paragraph(happened_words(facts)))
    if not advice:
        return
    yield parts.heading("What to try next")
    for one in advice:
        pieces = [parts.paragraph(one.found)]
        if one.command:
            pieces.append(parts.commands(one.command.replace("RUN", str(facts.run.path)).splitlines()))
        if one.plot is not None:
            plot = one.plot()
            pieces.append(parts.details(plot.title, figure_part(plot.without_title(), plot.title, dpi=90)))
        yield parts.card(*pieces, head=one.try_)


def _learning(facts: RunFacts) -> Pieces:
    yield parts.heading("How it learned")
    score = facts.kind.score
    large = figures.Panel(score.name, figures.LEARNING.curves, score.lowest)
    if figures.has_values(facts.metrics, large):
        yield parts.card(parts.chart(figures.panel_chart(facts.metrics, large)))
    small = figures.small_panels(facts.metrics)
    yield parts.grid(*(parts.card(parts.chart(figures.panel_chart(facts.metrics, one))) for one in small))


def _evaluations(facts: RunFacts) -> Pieces:
    of_world = facts.kind.piece("evaluation_table")
    rows = (of_world(facts.evaluations) if of_world else None) or return_table(facts.evaluations)
    if rows is None:
        return
    yield parts.heading("Evaluations")
    yield parts.paragraph(rows.description)
    yield parts.card(parts.table(rows.heads, rows.rows, rows.numbers))


def _small_print(facts: RunFacts) -> Pieces:
    yield parts.heading("Small print")
    settings = [
        (f"{group}.{name}", _plain(value))
        for group, values in facts.job.get("settings", {}).items()
        for name, value in values.items()
    ]
    if settings:
        yield parts.details("Settings", parts.table(("setting", "value"), settings))
    rows = [(name, _plain(value)) for name, value in facts.job.get("asked", {}).items()]
    rows += [(name, _plain(facts.job[name])) for name in ("seed", "threads", "started", "track") if name in facts.job]
    yield parts.details("What was asked", parts.table(("asked", "value"), rows))
    versions = list(facts.job.get("versions", {}).items())
    if versions:
        yield parts.details("Versions", parts.table(("package", "version"), versions))
    present = [name for name in facts.metrics[-1] if name in METRICS]
    glossary = [(name, _plain(facts.metrics[-1][name]), METRICS[name]) for name in present]
    yield parts.details("Figures of the last iteration", parts.terms(glossary))


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(_plain(part) for part in value) or "none"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_plain(part)}" for name, part in value.items())
    return "none" if value is None else str(value)
