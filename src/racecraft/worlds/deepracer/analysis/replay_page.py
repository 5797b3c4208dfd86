"""Is it the same car? A replay of recorded races on one web page that can be e-mailed. Begin with `write_replay_page`.

the answer → the picture → the track, row by row → the car, window by window → every file → how it was measured

The page is made of what `racecraft replay --json` prints and of pictures; it judges nothing by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from racecraft.analysis.figures import small_axes
from racecraft.analysis.page import figure_part, photograph
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.pages.colours import BLUE, INK, ORANGE, QUIET
from racecraft.pages.parts import Heading, card, details, heading, page, paragraph, table, tiles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CARS = {
    "v4": "the classic simulator's car until mid-2022, metadata version 1 to 4",
    "v5-classic": "the classic simulator's later car, metadata version 5",
    "v6": "the ROS 2 simulator's car",
    "v6-unlimited": "the ROS 2 simulator's car without limits of grip, acceleration and speed",
    "kinematic": "the ideal bicycle, for teaching",
}
CHECKS = {
    "progress_mismatches": "progress, to a hundredth of a point",
    "closest_waypoint_mismatches": "closest waypoint",
    "all_wheels_mismatches": "all wheels on the track",
    "off_track_mismatches": "off the track",
}
FURTHEST_SHOWN_M = 0.4
HORIZON_WORDS = {"0.5s": "half a second", "1s": "a second"}

Facts = Mapping[str, Any]


def write_replay_page(path: str | Path, facts: Facts, picture: Figure, errors_m: Mapping[str, Array]) -> Path:
    """Write the page.

    Args:
        path: The page, .html; it arrives whole.
        facts: What `ReplayReport.as_dictionary` gives.
        picture: A recorded lap with our car's attempts on it.
        errors_m: How far our car strayed in every window, m, by horizon ("0.5s", "1s").

    Returns:
        The path.

    Raises:
        OutputFileError: The page cannot be written.
    """
    title = "Is it the same car?"
    write_atomic(path, page(title, _parts(facts, picture, errors_m), tab=f"{title} {facts['track']}"))
    return Path(path)


def answer(facts: Facts) -> str:
    """Return the answer to the page's question in a sentence or two.

    >>> answer({"same_track": True, "same_car": None, "car": "v4"})
    'The track is the same. No stretch was recorded long enough to tell the car.'
    """
    track = "The track is the same." if facts["same_track"] else "The track is not quite the same."
    if facts["same_car"] is None:
        return f"{track} No stretch was recorded long enough to tell the car."
    recorded = facts.get("recorded_car")
    if recorded and recorded["car"] is None:
        return f"{track} But {facts['verdict']}."
    why = f" ({facts['verdict'].partition('(')[2]}" if recorded else ""
    if facts["same_car"]:
        return f"{track} So is the car: it is {facts['car']}{why}."
    if recorded:
        return f"{track} Of our cars it is {facts['car']}{why}; it strays further than our limit for the same car."
    return f"{track} The car is not: {facts['car']} strays further than it should."


def _parts(facts: Facts, picture: Figure, errors_m: Mapping[str, Array]) -> Iterator[Heading | Markup]:
    yield from _headline(facts)
    words = "A recorded lap, coloured by commanded speed; in red our car, obeying the same commands a second at a time"
    lines = (
        "The wide line is the longest recorded episode. Every red line begins on it, where our car was put, and shows "
        "where it went in the next second, obeying the recorded commands without ever looking. Where no red is to be "
        "seen, it lies on the recorded line."
    )
    yield card(photograph(picture, words), paragraph(lines, "quiet"))
    yield from _track(facts)
    yield from _car(facts, errors_m)
    yield from _files(facts)
    yield from _notes(facts)


def _headline(facts: Facts) -> Iterator[Heading | Markup]:
    yield paragraph(answer(facts), "strong")
    yield paragraph(
        f"{facts['rows']:,} recorded rows, {facts['episodes']:,} episodes, {len(facts['files'])} "
        f"file(s), on {facts['track']}; driven again by {facts['car']}, {CARS.get(facts['car'], 'a car')}.",
        "quiet",
    )
    figures = [(_agreement(facts["progress_mismatches"], facts["rows"]), "of all rows have the same progress")]
    for name, words in HORIZON_WORDS.items():
        median = facts["open_loop_position_m"][name]["median"]
        figures.append((_cm(median), f"apart after {words} without looking, median"))
    figures.append((f"{sum(facts['windows'].values()):,}", "times it was measured"))
    yield tiles(figures)


def _track(facts: Facts) -> Iterator[Heading | Markup]:
    yield heading("The same track?")
    yield paragraph(
        "From nothing but the recorded poses, racecraft works out what the original wrote beside them. "
        "Every row that differs is counted."
    )
    rows = []
    for key, words in CHECKS.items():
        wrong = facts[key]
        row = ("not recorded", "–") if wrong is None else (f"{wrong:,}", _agreement(wrong, facts["rows"]))
        rows.append((words, *row))
    yield card(table(("told again", "rows that differ", "agree"), rows, (1, 2)))


def _car(facts: Facts, errors_m: Mapping[str, Array]) -> Iterator[Heading | Markup]:
    yield heading("The same car?")
    yield paragraph(
        "From every fifth row in which the car was driven, ours is put where the recorded one stood and obeys its "
        "commands, without ever looking. A car that turned or gained speed otherwise would end elsewhere."
    )
    rows = []
    for name, words in HORIZON_WORDS.items():
        position, yaw = facts["open_loop_position_m"][name], facts["open_loop_yaw_deg"][name]
        angles = (_degrees(yaw["median"]), _degrees(yaw["p90"]))
        rows.append(
            (f"after {words}", f"{facts['windows'][name]:,}", _cm(position["median"]), _cm(position["p90"]), *angles)
        )
    heads = ("horizon", "windows", "median", "9 of 10 within", "turned, median", "9 of 10 within")
    yield card(table(heads, rows, (1, 2, 3, 4, 5)))
    if any(len(errors) for errors in errors_m.values()):
        words = "Share of windows in which our car strayed no further than that"
        yield card(figure_part(_spread_figure(errors_m), words))


def _files(facts: Facts) -> Iterator[Heading | Markup]:
    rows = []
    for one in facts["files"]:
        wrong = sum(one[key] or 0 for key in CHECKS)
        medians = (_cm(one["open_loop_position_m"][name]["median"]) for name in HORIZON_WORDS)
        rows.append((_short(one["file"]), f"{one['rows']:,}", f"{wrong:,}", *medians))
    heads = ("file", "rows", "differences", "0.5 s", "1 s")
    yield heading("Every file")
    yield card(table(heads, rows, (1, 2, 3, 4)))
    worst = [
        (_furthest(window), _short(one["file"]), window) for one in facts["files"] for window in one["worst_windows"]
    ]
    lines = [
        (f"{file}, episode {window['episode']} from step {window['steps']}", _cm(far))
        for far, file, window in sorted(worst, key=lambda part: -part[0])[:20]
    ]
    if lines:
        yield details("Where our car strayed furthest", table(("window", "apart"), lines, (1,)))


def _notes(facts: Facts) -> Iterator[Heading | Markup]:
    notes = [*facts["notes"], *facts["damaged_rows"]]
    if notes:
        yield heading("Worth knowing")
        yield card(*map(paragraph, notes))
    yield paragraph(
        "Half a second is 8 ticks and a second 15. Distances are those of the point 14 cm ahead of "
        "the car's middle that the records speak of; its read-out alone jitters by 2 to 3 cm. The same car is one "
        "whose median after a second stays within 12 cm (v4), 20 cm (v5-classic) or 11 cm (v6) below 2 m/s, and "
        "within 25, 40 or 25 cm above. Wheels are compared where the car is not being held.",
        "quiet",
    )


def _spread_figure(errors_m: Mapping[str, Array]) -> Figure:
    """Return the share of windows within every distance, one curve a horizon."""
    figure, axes = small_axes("share of windows (%) no further apart than", 5.4, 3.1, size=12)
    for (name, errors), colour in zip(errors_m.items(), (BLUE, ORANGE), strict=False):
        if not len(errors):
            continue
        ordered = np.sort(errors)
        share = 100.0 * np.arange(1, len(ordered) + 1) / len(ordered)
        axes.plot(100.0 * ordered, share, color=colour, lw=2.0, label=f"after {HORIZON_WORDS.get(name, name)}")
    axes.set_xlim(0, 100.0 * FURTHEST_SHOWN_M)
    axes.set_ylim(0, 100)
    axes.set_xlabel("distance (cm)", fontsize=11, color=QUIET)
    axes.legend(loc="lower right", frameon=False, fontsize=11, labelcolor=INK)
    return figure


def _furthest(window: Facts) -> float:
    return max((far for far in window["position_m"].values() if far is not None), default=0.0)


def _short(path: str) -> str:
    """Return the last two names of a path: files of several workers bear the same one.

    >>> _short("logs/0/training-simtrace/12-iteration.csv")
    'training-simtrace/12-iteration.csv'
    """
    return "/".join(Path(path).parts[-2:])


def _agreement(wrong: int, rows: int) -> str:
    """Return how many rows agree; never 100 % where one does not.

    >>> _agreement(0, 40000), _agreement(1, 40000)
    ('100 %', '99.99 %')
    """
    return "100 %" if wrong == 0 else f"{min(99.99, 100.0 * (1.0 - wrong / rows)):.2f} %"


def _cm(metres: float | None) -> str:
    return "–" if metres is None else f"{100.0 * metres:.1f} cm"


def _degrees(angle: float | None) -> str:
    return "–" if angle is None else f"{angle:.1f}°"
