"""A reward function as a page: remarks in its lines, what pays more than lapping, pay over the road, old laps.

Begin with `reward_data`. The parts stand in `pages/templates/reward_parts.html`; the console shows the same ones.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.message import ends, figure
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.pages.chart import Chart, Series
from racecraft.pages.render import render_file
from racecraft.worlds.deepracer.analysis.svg_lines import svg_path, svg_view
from racecraft.worlds.deepracer.driving.reward.check import RewardCheck
from racecraft.worlds.deepracer.driving.reward.findings import FAULT, Finding
from racecraft.worlds.deepracer.driving.reward.pay_map import PayMap
from racecraft.worlds.deepracer.driving.reward.rescore import Rescored
from racecraft.worlds.deepracer.driving.reward.tricks import Trick

TEMPLATE = "racecraft.worlds.deepracer.pages/reward.html"
COLOURS = 5
"""Values of the tokens, from the lowest pay to the highest."""
EDGE_M = 0.5
MAX_LAPS = 40


def write_reward_page(
    path: Path,
    title: str,
    found: RewardCheck | None = None,
    mapped: PayMap | None = None,
    rescored: Rescored | None = None,
) -> None:
    """Write a page that is one file and works offline, with the parts that are given.

    Raises:
        OutputFileError: The place cannot be written.
    """
    data = reward_data(found, mapped, rescored)
    write_atomic(path, render_file(TEMPLATE, title=title, told=data))


def reward_data(
    found: RewardCheck | None = None, mapped: PayMap | None = None, rescored: Rescored | None = None
) -> dict[str, Any]:
    """Return what the parts of `reward_parts.html` show, as plain values; a part that is not given is None."""
    return {
        "check": None if found is None else _check(found),
        "map": None if mapped is None else map_data(mapped),
        "rescored": None if rescored is None else _rescored(rescored),
    }


def map_data(mapped: PayMap) -> dict[str, Any]:
    """Return the road with every place coloured by its pay, as paths of an SVG; y runs downwards, metres."""
    track = mapped.track
    finite = mapped.pay[np.isfinite(mapped.pay)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    share = np.nan_to_num((mapped.pay - low) / max(high - low, 1e-9), nan=-1.0)
    level = np.minimum(np.floor(COLOURS * share), COLOURS - 1)
    lowest, highest = ends(low, high)
    return {
        "words": f"{track.title or track.name}: {mapped.what} from {lowest} to {highest}, {mapped.at}",
        "title": f"What it pays: {mapped.what}",
        "about": f"{track.title or track.name}, {mapped.at}",
        "view": svg_view(track, EDGE_M),
        "borders": [svg_path(line, track.closed) for line in (track.inner, track.outer)],
        "cells": [(colour + 1, _cells(mapped, level == colour)) for colour in range(COLOURS)],
        "low": lowest,
        "high": highest,
    }  # fmt: skip


def _cells(mapped: PayMap, chosen: Array) -> str:
    """Return the outline of every chosen place, as one path."""
    xy = mapped.xy
    around = np.roll(xy, -1, axis=0) if mapped.track.closed else np.concatenate([xy[1:], xy[-1:]])
    along = 0.5 * (around - xy)
    across = 0.5 * np.gradient(xy, axis=1)
    corners = [xy + across, xy + across + 2 * along, xy - across + 2 * along, xy - across]
    return "".join(
        "M" + "L".join(f"{x:.2f} {-y:.2f}" for x, y in (corner[place] for corner in corners)) + "Z"
        for place in zip(*np.nonzero(chosen), strict=True)
    )


def _range(found: RewardCheck) -> str:
    return "–" if found.lowest is None or found.highest is None else " to ".join(ends(found.lowest, found.highest))


def _check(found: RewardCheck) -> dict[str, Any]:
    return {
        "sentence": _sentence(found),
        "findings": [_finding(one) for one in found.findings],
        "lines": _lines(found),
        "stats": [
            (f"{found.faults}", "faults"), (f"{len(found.findings) - found.faults}", "notes"),
            (_range(found), "pay of a tick"), (found.cost, "a call"),
        ],
        "tricks": [_trick(one) for one in found.tricks],
        "speed": None if found.speed is None else f"The reward {found.speed.sentence}.",
        "laps": None if not found.laps else _laps_chart(found).shown(),
    }  # fmt: skip


def _sentence(found: RewardCheck) -> str:
    first = next((one for one in found.findings if one.level == FAULT), None)
    if first is None:
        return "No fault was found."
    place = f"Line {first.line}: " if first.line else ""
    return f"{place}{_capital(first.text) if not place else first.text}. {first.hint}".strip()


def _finding(one: Finding) -> dict[str, Any]:
    head = f"Line {one.line}:" if one.line else ("Fault:" if one.level == FAULT else "Note:")
    return {"kind": "bad" if one.level == FAULT else "warn", "head": head, "text": f"{one.text}. {one.hint}".strip()}


def _lines(found: RewardCheck) -> list[dict[str, Any]]:
    """Return the lines of the file with the worst remark of each."""
    worst: dict[int, str] = {}
    for one in found.findings:
        if one.line:
            worst.setdefault(one.line, "bad" if one.level == FAULT else "warn")
    return [
        {"number": number, "text": text, "kind": worst.get(number, "")}
        for number, text in enumerate(found.source.text.splitlines(), 1)
    ]


def _trick(one: Trick) -> dict[str, Any]:
    """Return a trick with both pays as shares of the larger."""
    size = max(abs(one.pays), abs(one.lap_pays), 1e-9)
    return {
        "name": _capital(one.name), "share": max(0.0, one.pays / size),
        "lap_share": max(0.0, one.lap_pays / size), "pays": f"{figure(one.pays)} {one.unit}",
        "lap": f"{figure(one.lap_pays)} {one.unit}", "answer": one.answer,
    }  # fmt: skip


def _laps_chart(found: RewardCheck) -> Chart:
    tracks = list(dict.fromkeys(name for name, _, _ in found.laps))
    series = []
    for track in tracks:
        rows = sorted((seconds, earned) for name, seconds, earned in found.laps if name == track)
        series.append(Series(track, [one for one, _ in rows], [one for _, one in rows], "dots"))
    return Chart("What a whole lap earns", "lap time, s", "summed reward", series)


def _rescored(found: Rescored) -> dict[str, Any]:
    before, after = found.time_ranks
    laps = found.places()
    rows = [
        (str(lap.episode), f"{lap.seconds:.2f}", figure(lap.old), figure(lap.new), str(old), str(new))
        for lap, old, new in laps[:MAX_LAPS]
    ]
    episodes = sorted((one.old, one.new) for one in found.episodes)
    dots = Series("episodes", [old for old, _ in episodes], [new for _, new in episodes], "dots")
    charts = [Chart("Episodes, then and now", "reward in the log", "new reward", [dots])]
    if laps:
        seconds = [lap.seconds for lap, _, _ in laps]
        charts += [
            Chart(f"Complete laps, {when}", "lap time, s", name,
                  [Series("laps", seconds, [getattr(lap, key) for lap, _, _ in laps], "dots")])
            for when, name, key in (("then", "reward in the log", "old"), ("now", "new reward", "new"))
        ]  # fmt: skip
    return {
        "sentence": f"Of {len(found.episodes):,} episodes {len(laps):,} are complete laps. Both rewards order the "
        f"episodes with a rank correlation of {found.agreement:+.2f}.",
        "time": f"Lap time and reward: {before:+.2f} in the log, {after:+.2f} now; positive: slow laps earn more.",
        "heads": ("episode", "lap, s", "then", "now", "place then", "place now"),
        "rows": rows,
        "more": max(0, len(laps) - MAX_LAPS),
        "charts": [chart.shown() for chart in charts],
        "failures": [f"row {one.row}, line {one.line}: {one.message}" for one in found.failures[:10]],
    }


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
