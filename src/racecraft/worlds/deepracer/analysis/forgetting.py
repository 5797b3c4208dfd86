"""What a training learned and forgot, place by place, and whether it knows its starts only. Plain values and words.

Begin with `SegmentPassRates` and `StartComparison`; `passages_part` and `starts_part` are their parts of a page.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from racecraft.analysis.learning_advice import rose
from racecraft.analysis.page import photograph
from racecraft.contract.world import Array
from racecraft.pages.parts import Heading, card, heading, paragraph, table
from racecraft.worlds.deepracer.analysis.logs.plot import HEAT, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KNOWN, LOST = 0.9, 0.6
"""Share of the cars that get through a place from which it is known, and below which it is not."""
ENOUGH = 4
"""Cars that must have come to a place before anything is said of it."""
CHANCE = 0.05
"""A difference that chance alone makes more often than this is none."""


@dataclass(frozen=True, eq=False)
class SegmentPassRates:
    """How many cars of C checkpoints, from the same starts, came to each of P places and got through."""

    run: str
    iterations: Sequence[int]
    """(C,) of the checkpoints, rising."""
    places: Sequence[str]
    """(P,) segments of the track in driving order, such as "turn 2 (left)"."""
    reached: Array
    """int64 (P, C)."""
    passed: Array
    """int64 (P, C)."""
    rewards: Sequence[float | None] = ()
    """What an episode was paid in the mean in each checkpoint's iteration, (C,); () or None: not known."""
    typed: str = "racecraft train"
    """How this training is asked for, folder and track included."""

    @property
    def share(self) -> Array:
        """Share of those that came to it which got through, (P, C); NaN where fewer than ENOUGH came."""
        some = self.reached >= ENOUGH
        return np.where(some, self.passed / np.maximum(self.reached, 1), np.nan)

    @property
    def forgotten(self) -> list[tuple[int, int, int]]:
        """Places that an earlier checkpoint knew and the last one that came there does not: (place, then, now)."""
        found = []
        for place, row in enumerate(self.share):
            evaluated = np.flatnonzero(np.isfinite(row))
            known = evaluated[row[evaluated] >= KNOWN]
            if len(known) and row[evaluated[-1]] < LOST:
                found.append((place, int(known[-1]), int(evaluated[-1])))
        return found


def passages_words(rates: SegmentPassRates) -> list[str]:
    """Return what a training forgot, in sentences, what it was paid meanwhile, and the command that helps."""
    share = rates.share
    lines = [
        f"The car knew {rates.places[place]} and forgot it: at iteration {rates.iterations[then]} "
        f"{100 * share[place, then]:.0f} % got through, at iteration {rates.iterations[now]} "
        f"{100 * share[place, now]:.0f} %."
        for place, then, now in rates.forgotten
    ]
    if not lines:
        return [f"Of {len(rates.iterations)} checkpoints none forgot a place that an earlier one knew."]
    then, now = min(then for _, then, _ in rates.forgotten), max(now for _, _, now in rates.forgotten)
    go_on = f"{rates.typed} --from {rates.run}:{rates.iterations[then]} --set ppo.learning_rate=1e-4"
    return [*lines, f"{_why_forgotten(rates, then, now)}: {go_on}"]


def _why_forgotten(rates: SegmentPassRates, then: int, now: int) -> str:
    """Return what to do about it, up to the command: a reward that rose meanwhile may pay for something else."""
    paid = [rates.rewards[k] if rates.rewards else None for k in (then, now)]
    if paid[0] is None or paid[1] is None or not rose(paid[0], paid[1]):
        return "Go on from what knew the way, in smaller steps"
    return (
        f"Meanwhile the mean reward of an episode rose from {paid[0]:.4g} to {paid[1]:.4g}: see whether it pays for "
        "something else than getting round and change it, then go on from what knew the way"
    )


def passages_part(rates: SegmentPassRates) -> Iterator[Heading | Markup]:
    """Yield the part of a page."""
    yield heading("What it learned and forgot")
    words = "Share of the cars that got through each segment, by checkpoint"
    yield card(*map(paragraph, passages_words(rates)), photograph(passages_figure(rates), words))


def passages_figure(rates: SegmentPassRates) -> Figure:
    """Return the table place by checkpoint, in colours and per cent."""
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    share = rates.share
    places, checkpoints = share.shape
    figure = Figure(
        figsize=(max(9.0, 1.8 + 0.62 * checkpoints), 0.9 + 0.32 * places), layout="constrained", facecolor="white"
    )
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    colours = colormaps[HEAT].with_extremes(bad="#f0f2f4")
    axes.imshow(np.ma.masked_invalid(share), cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
    for (p, c), value in np.ndenumerate(share):
        if np.isfinite(value):
            ink = "white" if value < 0.55 else "black"
            axes.text(c, p, f"{100 * value:.0f}", ha="center", va="center", fontsize=9, color=ink)
    axes.set_xticks(range(checkpoints), [str(one) for one in rates.iterations], fontsize=9)
    axes.set_yticks(range(places), list(rates.places), fontsize=9)
    axes.tick_params(length=0)
    axes.set_xlabel("iteration of the checkpoint", fontsize=9, color=QUIET)
    axes.set_title(f"got through, % of the cars that came there (grey: fewer than {ENOUGH})", fontsize=10, loc="left")
    for side in axes.spines.values():
        side.set_visible(False)
    return figure


@dataclass(frozen=True)
class StartComparison:
    """Laps from starts that were trained on against laps from places in between."""

    trained_starts: int
    """Places that training started from."""
    spacing_m: float
    """The widest gap between two of them, m."""
    trained: int
    """Laps from such places."""
    trained_full: int
    between: int
    """Laps from inside the gaps."""
    between_full: int
    trained_progress: float
    """Mean, per cent of a lap."""
    between_progress: float
    near_m: float = 0.0
    """Where starts are few each was driven from several times, so far around it, m."""

    @property
    def by_chance(self) -> float:
        """How likely chance alone makes the starts in between so much worse or more (Fisher's exact test).

        >>> round(StartComparison(4, 1.0, 8, 8, 8, 2, 100.0, 40.0).by_chance, 4)
        0.0035
        """
        full, laps = self.trained_full + self.between_full, self.trained + self.between
        ways = comb(laps, full)
        return sum(
            comb(self.between, k) * comb(self.trained, full - k) for k in range(self.between_full + 1) if k <= full
        ) / max(ways, 1)

    @property
    def is_over_fitted(self) -> bool:
        """Whether it laps from where it was trained and not from in between, and not by chance."""
        return self.by_chance < CHANCE


def starts_words(comparison: StartComparison) -> str:
    """Return what the starts tell, in words."""
    places = f"{comparison.trained} places it was trained to start from"
    if comparison.near_m:
        where = "the place" if comparison.trained_starts == 1 else f"the {comparison.trained_starts} places"
        places = f"{where} it was trained to start from, give or take {100 * comparison.near_m:.0f} cm,"
    text = (
        f"From {places} {comparison.trained_full} of {comparison.trained} laps were driven to the end "
        f"({comparison.trained_progress:.0f} % of a lap in the mean), from places in between "
        f"{comparison.between_full} of {comparison.between} ({comparison.between_progress:.0f} %)."
    )
    if comparison.is_over_fitted:
        return (
            f"{text} It knows its starts, not the track: start from more places, with more worlds side by side "
            "(--set rollout.num_worlds=32) and race.change_start on."
        )
    if not comparison.trained_full:
        return f"{text} It does not lap from its own starts either, so that they are not what keeps it from lapping."
    return f"{text} It does not hang on where it starts."


def starts_part(comparison: StartComparison) -> Iterator[Heading | Markup]:
    """Yield the part of a page."""
    yield heading("Does it know its starts only?")
    heads = ("starts", "laps", "driven to the end", "mean progress")
    rows = [
        ("trained on", comparison.trained, comparison.trained_full, f"{comparison.trained_progress:.1f} %"),
        ("in between", comparison.between, comparison.between_full, f"{comparison.between_progress:.1f} %"),
    ]
    yield card(paragraph(starts_words(comparison)), table(heads, rows, (1, 2, 3)))


def passages_facts(rates: SegmentPassRates) -> dict[str, Any]:
    """Return the table as plain values; a share of too few cars is None."""
    return {
        "checkpoints": list(rates.iterations),
        "places": [
            {"segment": name, "passed_share": [None if np.isnan(one) else float(one) for one in row]}
            for name, row in zip(rates.places, rates.share, strict=True)
        ],
        "forgotten": [
            {"segment": rates.places[p], "known_at": rates.iterations[a], "lost_at": rates.iterations[b]}
            for p, a, b in rates.forgotten
        ],
    }
