"""A look on one web page: what the car goes by, in words, a table by surface, where it doubts, the film.

Begin with `write_saliency_page`; `findings` are its sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from racecraft.analysis.figures import small_axes
from racecraft.analysis.page import figure_part, photograph
from racecraft.analysis.page import film as film_part
from racecraft.formats.atomic import write_atomic
from racecraft.pages.colours import BLUE, INK, QUIET
from racecraft.pages.parts import Bar, Heading, card, heading, page, paragraph, table
from racecraft.worlds.deepracer.analysis.path_picture import DARK_RED
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries, glowing, shining
from racecraft.worlds.deepracer.analysis.saliency_film import CarPositions
from racecraft.worlds.deepracer.analysis.surfaces import OBSTACLE, SurfaceAttention
from racecraft.worlds.deepracer.files.sensor_names import LIDARS
from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOUBTS = 6
"""Pictures of the greatest doubt that are shown."""
APART = 15
"""Ticks that must lie between two of them: a second."""
OFF_THE_TRACK = ("wall", "sky")
MANY, FEW = 0.2, 0.05
"""Shares of decisions that count as many and as few."""
UNDECIDED = 0.05
"""Below this mean gap between best and second best, of probability, the order of options is almost chance."""


@dataclass(frozen=True, eq=False)
class LapSaliency:
    """A look at a lap that was driven for it."""

    series: SaliencySeries
    positions: CarPositions
    progress_percent: Any
    """(T,) of the lap, 0 to 100."""
    surfaces: Sequence[SurfaceAttention]
    """Most attention first; empty where the policy's camera is none of ours."""
    outcome: str
    """How the lap ended, in words."""


def findings(
    surfaces: Sequence[SurfaceAttention], look: SaliencySeries, run: str = "RUN", imported: bool = False
) -> list[str]:
    """Return what a look comes to, in sentences; the weightiest first.

    A surface beside the track is only blamed where no other counts for more: of a policy that is thrown by whatever is
    painted over, nothing can be said of the one. Of one that is hardly decided no surface is.

    Args:
        surfaces: What was found out of each.
        look: The look.
        run: What a command calls the run.
        imported: Whether it was trained elsewhere, and can only be begun anew with its weights.
    """
    lines = []
    gap = float(np.mean(look.confidence.gap))
    if gap < UNDECIDED:
        lines.append(
            f"It is hardly decided: its best action is only {100 * gap:.1f} % likelier than the second, so little "
            "turns a decision. Train on before you read much into what it looks at: "
            f"racecraft train {f'--from {run}' if imported else f'--run {run} --resume'}."
        )
    if not surfaces:
        return lines
    tried = {row.surface: row.changed for row in surfaces if row.changed is not None}
    off = max(((tried.get(name, 0.0), name) for name in OFF_THE_TRACK), default=(0.0, ""))
    of_track = max(((share, name) for name, share in tried.items() if name not in OFF_THE_TRACK), default=(0.0, ""))
    is_decided = gap >= UNDECIDED or not np.isfinite(gap)
    if off[0] >= MANY and is_decided and off[0] <= of_track[0]:
        lines.append(
            f"Whatever is painted over turns its decisions: {100 * of_track[0]:.0f} % with the {of_track[1]}, "
            f"{100 * off[0]:.0f} % with the {off[1]}. It goes by the picture as a whole, the {off[1]} included."
        )
    elif off[0] >= MANY and is_decided:
        lines.append(
            f"It goes by what is not the track: with the {off[1]} painted over, {100 * off[0]:.0f} % of its decisions "
            f"are others. Where the {off[1]} looks different it will drive differently; see it on another track before "
            f"you race: racecraft evaluate {run} --track Oval_track."
        )
    elif tried and off[0] <= FEW:
        lines.append("Walls and sky hardly matter to it: painted over, at most one decision of twenty is another.")
    edge = max(tried.get(name, 0.0) for name in ("border line", "grass"))
    if edge >= MANY and is_decided:
        lines.append(f"It goes by the edge of the road: without it {100 * edge:.0f} % of its decisions are others.")
    if (obstacles := tried.get(OBSTACLE)) is not None and is_decided:
        if obstacles <= FEW:
            lines.append(
                "What stands on the road hardly matters to it: with a box or bot in sight at most one decision of "
                "twenty is another without it. It does not drive round them by sight: give it more episodes among them."
            )
        else:
            lines.append(
                f"It sees what stands on the road: with a box or bot in sight {100 * obstacles:.0f} % of its decisions "
                "are others without it."
            )
    keen = max(surfaces, key=lambda row: row.times_its_area)
    lines.append(
        f"For its size the {keen.surface} gets most attention: {100 * keen.attention:.0f} % on {100 * keen.area:.1f} % "
        "of the picture."
    )
    return lines


def write_saliency_page(
    path: str | Path,
    lap: LapSaliency,
    title: str,
    film: bytes | None = None,
    run: str = "RUN",
    imported: bool = False,
) -> Path:
    """Write the page of a look at a lap; `run` and `imported` as in `findings`.

    Raises:
        OutputFileError: The page cannot be written.
    """
    sentences = findings(lap.surfaces, lap.series, run, imported)
    about = f"{title} · {lap.positions.track.title or lap.positions.track.name} · {lap.outcome}"
    pieces = _parts(lap, film, sentences)
    write_atomic(path, page("What it looks at", pieces, about, f"{title} – what it looks at"))
    return Path(path)


def _parts(lap: LapSaliency, film: bytes | None, sentences: Sequence[str]) -> Iterator[Heading | Markup]:
    """Yield the page from top to bottom."""
    if sentences:
        yield card(*map(paragraph, sentences))
    if film is not None:
        yield card(film_part(film, "The lap: camera, what counted in it, what was chosen"))
    yield from _surfaces(lap.surfaces)
    yield from _senses(lap.series)
    yield from _sureness(lap)
    yield paragraph(
        "Attention is the size of integrated gradients: what every pixel added to the decision, "
        "against an even grey. Painted over: the surface takes the grey of what surrounds it and the same moments are "
        "decided again.",
        "quiet",
    )


def _surfaces(surfaces: Sequence[SurfaceAttention]) -> Iterator[Heading | Markup]:
    if not surfaces:
        return
    yield heading("By surface")
    heads = ("surface", "attention", "", "of the picture", "times its area", "other decisions when painted over")
    rows = [
        (
            row.surface, f"{100 * row.attention:.1f} %", Bar(row.attention), f"{100 * row.area:.1f} %",
            f"{row.times_its_area:.1f}", "–" if row.changed is None else f"{100 * row.changed:.0f} %",
        )
        for row in surfaces
    ]  # fmt: skip
    yield card(table(heads, rows, numbers=(1, 3, 4, 5)))


def _senses(look: SaliencySeries) -> Iterator[Heading | Markup]:
    """Yield what a car with a LiDAR goes by: how much of it is the camera, and which beams or sectors count."""
    if not look.others:
        return
    yield heading("By what it sees with")
    rows = [(name, f"{100 * share:.1f} %", Bar(share)) for name, share in look.senses.items()]
    yield card(table(("observation", "attention", ""), rows, numbers=(1,)))
    for name in look.others:
        yield card(figure_part(beside_figure(look, name), f"Which of its numbers count: {name}"))


def beside_figure(look: SaliencySeries, name: str) -> Figure:
    """Return how much each number of an observation that is no picture counts, over the whole lap."""
    mean = look.others[name].mean(axis=0)
    figure, axes = small_axes(f"{name}: attention", 9.0, 2.4, 12)
    axes.bar(np.arange(len(mean)), 100.0 * mean / (mean.sum() or 1.0), width=0.8, color=BLUE)
    across = "from the right to the left of the LiDAR's nose" if name in LIDARS else "number"
    axes.set_xlabel(across, fontsize=11, color=QUIET)
    axes.set_ylabel("%", fontsize=11, color=QUIET)
    axes.set_xticks([])
    return figure


def _sureness(lap: LapSaliency) -> Iterator[Heading | Markup]:
    yield heading("How sure it is along the lap")
    values, words = lap.series.confidence_values
    if lap.series.has_constant_confidence:
        text = (
            f"Equally sure everywhere: its {words}, is {float(values[0]):.2f} at every moment. Such a "
            "policy learns one spread for the whole lap, which says how far it has come, not where it doubts."
        )
        yield card(paragraph(text))
        return
    yield card(figure_part(confidence_figure(lap), f"Along the lap: {words}"))
    yield card(photograph(confidence_map(lap), f"On the track: {words}"))
    yield heading("Where it doubts most")
    yield card(photograph(doubts_figure(lap), "The pictures it was least sure of", dpi=130))


def confidence_figure(lap: LapSaliency) -> Figure:
    """Return how sure it was over the lap."""
    values, words = lap.series.confidence_values
    figure, axes = small_axes(words, 9.0, 2.8, 12)
    axes.plot(lap.progress_percent, values, color=BLUE, lw=1.2)
    axes.plot(
        np.asarray(lap.progress_percent)[_doubts(lap.series)], values[_doubts(lap.series)], "X", color=DARK_RED, ms=7,
        label="shown below",
    )  # fmt: skip
    axes.set_xlabel("progress (% of the lap)", fontsize=11, color=QUIET)
    axes.set_xlim(0, 100)
    beside_title = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}  # never on the curve
    axes.legend(frameon=False, fontsize=10, labelcolor=INK, **beside_title)
    return figure


def confidence_map(lap: LapSaliency) -> Figure:
    """Return how sure it was, on the track."""
    values, words = lap.series.confidence_values
    path = PaintedPath(lap.positions.xy, values, words)
    return draw_track(lap.positions.track, paths=[path], number_every=0, title="How sure it is")


def doubts_figure(lap: LapSaliency) -> Figure:
    """Return the pictures of greatest doubt, with what counted in them."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    look, heat = lap.series, shining(lap.series.heat)
    rows = _doubts(look)
    columns = min(3, max(1, len(rows)))
    lines = max(1, -(-len(rows) // columns))
    figure = Figure(figsize=(9.0, 2.95 * lines), layout="constrained")
    FigureCanvasAgg(figure)
    for number, row in enumerate(rows):
        axes = figure.add_subplot(lines, columns, number + 1)
        axes.imshow(glowing(look.frames[row], heat[row], (400, 300)))
        axes.axis("off")
        sentences = [f"{what} {words}" for what, _, words in look.decision(row)]
        axes.set_title(f"{lap.progress_percent[row]:.0f} % of the lap\n" + "\n".join(sentences), fontsize=9, loc="left")
    return figure


def _doubts(look: SaliencySeries) -> list[int]:
    """Return the pictures of greatest doubt that do not lie beside each other, in the order of the lap."""
    kept: list[int] = []
    for row in look.least_confident.tolist():
        if all(abs(row - other) >= APART for other in kept):
            kept.append(row)
        if len(kept) == DOUBTS:
            break
    return sorted(kept)
