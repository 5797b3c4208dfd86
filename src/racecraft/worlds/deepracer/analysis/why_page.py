"""Why a policy fails, on one web page: a card a place, with map, camera, actions, reward and cures.

Begin with `write_why_page`; `failure_parts` are the same cards for the report of a run.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from racecraft.analysis.figures import small_axes
from racecraft.analysis.page import figure_part, photograph
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.pages.colours import CYCLE, INK, RED
from racecraft.pages.parts import Heading, card, details, grid, heading, page, paragraph, table
from racecraft.pages.plain_json import plain_json
from racecraft.worlds.deepracer.analysis.failure_places import (
    Before,
    FailurePlace,
    RewardLine,
    Why,
    facts,
    place_words,
    sentences,
)
from racecraft.worlds.deepracer.analysis.forgetting import SegmentPassRates, StartComparison, passages_part, starts_part
from racecraft.worlds.deepracer.analysis.logs.plot import QUIET, map_sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FACTS_FORMAT = "racecraft why"
PICTURES = 5
"""Frames that are shown of the last second."""
COLUMNS = 6
"""Ticks of the last second in the table of the reward."""
MAX_LINES = 14
"""Lines of the reward function in that table: those that change most."""


def write_why_facts(path: Path, why: Why) -> None:
    """Write what the page says as JSON: the facts, where each failure lies (m), and pictures of the last second.

    Raises:
        OutputFileError: The place cannot be written.
    """
    data = facts(why)
    for place, known in zip(why.places, data["places"], strict=True):
        known["words"] = place_words(place, why.failures)
        known["xy"] = np.round(place.xy, 3).tolist()
        known["picture_jpeg"] = base64.b64encode(_frame_strip(place.before)).decode()
    paths = [np.round(path[::3], 2).tolist() for path in why.paths]
    text = plain_json({"format": FACTS_FORMAT, "version": 1, **data, "paths": paths})
    write_atomic(path, text + "\n")


def _frame_strip(before: Before) -> bytes:
    """Return pictures of the last second side by side, as JPEG."""
    from PIL import Image

    pictures = [before.frames[k] for k in _spread(len(before.seconds), PICTURES)]
    out = io.BytesIO()
    Image.fromarray(np.concatenate(pictures, axis=1)).save(out, "JPEG", quality=85)
    return out.getvalue()


def write_why_page(
    path: str | Path,
    why: Why,
    title: str,
    learned: SegmentPassRates | None = None,
    starts: StartComparison | None = None,
) -> Path:
    """Write the page.

    Args:
        path: .html; it arrives whole.
        why: What is told.
        title: Of the run and its checkpoint.
        learned: What its checkpoints knew.
        starts: How it drives from starts that it was not trained on.

    Raises:
        OutputFileError: The page cannot be written.
    """
    about = f"{title} · {why.track.title or why.track.name}"
    pieces = _parts(why, learned, starts)
    write_atomic(path, page("Why it fails", pieces, about, f"{title} – why it fails"))
    return Path(path)


def _parts(why: Why, learned: SegmentPassRates | None, starts: StartComparison | None) -> Iterator[Heading | Markup]:
    yield heading("Where it fails")
    yield from failure_parts(why)
    if why.places:
        yield paragraph(
            "Every car drove greedily, and each of its ticks was kept. What would have saved it was "
            f"driven, not guessed: {why.changes:,} times a failed drive was taken up again, one action was changed and "
            f"the policy drove on; saved is who then passed the place by 1.5 m. It took {why.seconds:.0f} s.",
            "quiet",
        )
    if learned is not None:
        yield from passages_part(learned)
    if starts is not None:
        yield from starts_part(starts)


def failure_parts(why: Why) -> Iterator[Markup]:
    """Yield the sentences, the map and a card a place."""
    yield card(paragraph(sentences(why)[0], "strong"))
    if not why.places:
        return
    words = "How the failed cars drove and where they ended; numbers are those of the places below"
    yield card(photograph(map_figure(why), words))
    for place in why.places:
        yield from _place(place, why.failures)
    if why.reward_note:
        yield paragraph(f"What it was paid is not told: {why.reward_note}", "quiet")
    if why.not_explained:
        yield paragraph(f"{why.not_explained} more failed at other places, one here and one there.", "quiet")


def map_figure(why: Why) -> Figure:
    """Return the paths of the failed cars and the numbered places."""
    figure, (axes,) = map_sheet(why.track, 1, [""])
    for path in why.paths:
        axes.plot(*np.asarray(path).T, color=CYCLE[0], lw=0.8, alpha=0.35, zorder=2.5)
    for place in why.places:
        axes.plot(*place.xy.T, "X", color=RED, ms=6, alpha=0.6, mew=0, zorder=3)
        x, y = place.xy.mean(axis=0)
        axes.annotate(
            str(place.number), (x, y), xytext=(10, 10), textcoords="offset points", fontsize=12, color=INK,
            weight="bold", zorder=5, bbox={"boxstyle": "circle,pad=0.25", "fc": "white", "ec": RED},
        )  # fmt: skip
    figure.patch.set_facecolor("white")
    return figure


def _place(place: FailurePlace, failures: int) -> Iterator[Markup]:
    text = place_words(place, failures)
    if place.in_training:
        text += f" Late in the training {place.in_training} cars left the road here."
    frames = photograph(frames_figure(place.before), "What the camera saw in the last second", dpi=120)
    yield card(paragraph(text), frames, head=f"{place.number}: {place.where}")
    yield grid(_cures(place), _chances(place))
    if place.before.rewards is not None:
        yield details(
            "What it was paid in that second, line by line", *_reward_table(place.before, place.before.rewards)
        )


def frames_figure(before: Before) -> Figure:
    """Return pictures of the last second, with what was chosen at each."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    indices = _spread(len(before.seconds), PICTURES)
    figure = Figure(figsize=(2.1 * len(indices), 2.1), layout="constrained")
    FigureCanvasAgg(figure)
    for number, k in enumerate(indices):
        axes = figure.add_subplot(1, len(indices), number + 1)
        axes.imshow(before.frames[k])
        axes.axis("off")
        at_end = before.seconds[k] == 0.0
        when = "the end" if at_end else f"{before.seconds[k]:.1f} s before"
        chosen = f"{before.driven_mps[k]:.1f} m/s" if at_end else before.actions[k]
        axes.set_title(f"{when}\n{chosen}", fontsize=8, loc="left", color=INK)
    return figure


def _cures(place: FailurePlace) -> Markup:
    heads = ("before", "waypoint", "instead of", "this", "held", "saves")
    rows = [
        (
            f"{cure.seconds_before:.1f} s", cure.waypoint, cure.instead_of, cure.action, f"{cure.held_seconds:.1f} s",
            f"{cure.saved} of {cure.tried}",
        )
        for cure in place.cures
    ]  # fmt: skip
    if not rows:
        return card(paragraph("Nothing that was tried."), head="What would have saved it")
    return card(table(heads, rows, (0, 1, 4, 5)), head="What would have saved it")


def _chances(place: FailurePlace) -> Markup:
    last = place.last_chance
    text = (
        "At no moment that was tried does any action save half of them."
        if last is None
        else f"Up to {last:.1f} s before the end some action still saves half of them."
    )
    words = "Share of the failures that some action saves, by the moment"
    return card(paragraph(text), figure_part(chances_figure(place), words), head="When it could still be saved")


def chances_figure(place: FailurePlace) -> Figure:
    """Return which share of the failures some action saves, over the moment at which it is taken."""
    figure, axes = small_axes("saved by some action (%)", 4.6, 2.4, 10)
    for k, held in enumerate(place.held_seconds):
        axes.plot(
            place.moments, 100.0 * place.saveable[:, k], color=CYCLE[k], lw=1.6, marker="os^D"[k % 4], ms=4,
            label=f"held for {held:.1f} s",
        )  # fmt: skip
    axes.set_xlim(float(place.moments.max()), 0.0)
    axes.set_ylim(-3, 103)
    axes.set_xlabel("s before the end", fontsize=9, color=QUIET)
    axes.legend(frameon=False, fontsize=8, labelcolor=INK)
    return figure


def _reward_table(before: Before, rewards: Array) -> Iterator[Markup]:
    indices = _spread(len(before.seconds), COLUMNS)
    heads = ("line", "what it says", *(f"{before.seconds[k]:.1f} s" for k in indices))
    rows: list[tuple[object, ...]] = [("", "reward", *(_number(rewards[k]) for k in indices))]
    for line in sorted(_livelier(before), key=lambda one: one.line):
        rows.append((line.line, line.text or line.name, *(_number(line.values[k]) for k in indices)))
    yield table(heads, rows, tuple(range(2, len(heads))))
    yield paragraph("A dash: the line was not run in that tick.", "quiet")


def _livelier(before: Before) -> list[RewardLine]:
    """Return the lines that change most in that second, for their size."""

    def change(values: Array) -> float:
        there = values[np.isfinite(values)]
        missing = float(np.isnan(values).any())
        return missing + float(np.ptp(there) / (np.abs(there).max() or 1.0)) if len(there) else 0.0

    return sorted(before.lines, key=lambda line: -change(line.values))[:MAX_LINES]


def _number(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{value:.4g}"


def _spread(count: int, most: int) -> list[int]:
    """Return so many of `count` indices at most, evenly, the last among them."""
    return sorted({round(float(k)) for k in np.linspace(0, count - 1, min(count, most))})
