"""What a reward pays at every place of a track, as colour. Begin with `pay_map`.

A car stands at each place with one heading, speed and steering. Each place is an episode of two ticks, the first one
tick behind, so a reward that pays for what was gained since the last call is asked as in a drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.poses import one_tick_behind, place_on_road, reports_of
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.kernels.vehicle import drive
from racecraft.worlds.deepracer.env.race import TICK_REPORT
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

SPACING_M, LANES = 0.12, 17
REACH = 1.15
"""The map reaches so far over the border, as a share of half the width."""
BAR_IN = 1.0
"""Room for the colour bar, inches."""
PULL_PLACES, PULL_TICKS = 60, 8
"""Where the pull of actions is tried, and for how long each is held: half a second."""


@dataclass(frozen=True, eq=False)
class PayMap:
    """Pay over the road: A stations along it, L places across."""

    track: Track
    xy: Array
    """(A, L, 2) m: the car's front point."""
    offsets: Array
    """(A, L) m from the centre line, left positive."""
    pay: Array
    """(A, L); NaN where the reward failed, or where the term was not computed."""
    what: str
    """"pay", or the term that is shown."""
    at: str
    """Speed, heading and steering, in words."""
    terms: tuple[str, ...]
    """What could be shown: the variables that held a number anywhere, where `terms` were asked."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        finite = self.pay[np.isfinite(self.pay)]
        return {
            "track": self.track.name, "what": self.what, "terms": list(self.terms),
            "lowest": float(finite.min()) if finite.size else None,
            "highest": float(finite.max()) if finite.size else None,
            "x_m": self.xy[..., 0].round(3).tolist(), "y_m": self.xy[..., 1].round(3).tolist(),
            "offset_m": self.offsets.round(3).tolist(),
            "pay": np.where(np.isfinite(self.pay), self.pay, np.nan).round(6).tolist(),
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Pull:
    """What each action earns from places on the centre line, held for half a second."""

    arcs: Array
    """(P,) m."""
    earned: Array
    """(P, A) summed pay."""
    labels: tuple[str, ...]
    """(A,)."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        best = self.earned.argmax(axis=1)
        return {
            "actions": [
                {"action": label, "mean_pay": float(self.earned[:, k].mean()), "best_share": float((best == k).mean())}
                for k, label in enumerate(self.labels)
            ],
            "best_by_arc_m": [[round(float(arc), 3), int(one)] for arc, one in zip(self.arcs, best, strict=True)],
        }


def pay_map(
    payer: Payer,
    track: Track,
    speed: float,
    heading_error: float = 0.0,
    steering: float = 0.0,
    term: str | None = None,
    with_terms: bool = False,
) -> PayMap:
    """Pay a car at every place of a track.

    Args:
        payer: The reward function.
        track: The circuit, in driving direction.
        speed: Commanded speed, m/s; the car also gains so much in the tick before.
        heading_error: Between the car and the road, rad, positive where it looks further left.
        steering: Commanded angle, rad, positive left.
        term: Show this variable's last value in place of the pay; None: the pay.
        with_terms: Whether to tell which terms there are, at the cost of a slower call.
    """
    stations = max(24, round(track.length / SPACING_M))
    arcs = np.linspace(0.0, track.length, stations, endpoint=False)
    across = np.linspace(-REACH, REACH, LANES)
    half = 0.5 * track.locate(np.array([track.pose_at(arc)[:2] for arc in arcs])).width
    offsets = half[:, None] * across
    here = place_on_road(
        track, np.repeat(arcs, LANES), offsets.ravel(), np.full(offsets.size, heading_error), steering, speed
    )
    rows = _pairs(track, here, np.repeat(arcs, LANES))
    paid = payer.compute_rewards(track, rows, is_traced=with_terms or term is not None, is_reversed=track.is_reversed)
    values: Array = paid.rewards[1::2]
    terms: tuple[str, ...] = ()
    if paid.traces:
        last = [one.values for one in paid.traces[1::2]]
        terms = tuple(sorted(set().union(*last)))
        if term is not None:
            values = np.array([one.get(term, np.nan) for one in last])
    front = rows[1::2]
    at = f"{speed:g} m/s, heading {np.degrees(heading_error):+.0f}°, steering {np.degrees(steering):+.0f}°"
    xy = np.stack([front["front_x"], front["front_y"]], axis=-1).reshape(stations, LANES, 2)
    return PayMap(track, xy, offsets, values.reshape(stations, LANES), term or "pay", at, terms)


def pull_of_actions(payer: Payer, track: Track, car: CarProfile, table: ActionTable, speed: float) -> Pull:
    """Return what each action earns when it is held from places on the centre line.

    Args:
        payer: The reward function.
        track: The circuit, in driving direction.
        car: How the car answers.
        table: The actions.
        speed: At which the car arrives, m/s.
    """
    arcs = np.linspace(0.0, track.length, PULL_PLACES, endpoint=False)
    rows = []
    for arc in arcs:
        start = track.pose_at(arc)
        for steering, told_speed in zip(table.steering, table.speed, strict=True):
            path = []
            x, y, yaw, now, angle = start.x, start.y, start.yaw, speed, 0.0
            for _ in range(PULL_TICKS + 1):
                path.append((x, y, yaw, steering, told_speed))
                x, y, yaw, now, angle = drive(car, x, y, yaw, now, angle, angle, now, steering, told_speed)
            rows.append(reports_of(track, np.array(path), arc / track.length, laps=False))
    paid = payer.compute_rewards(track, np.concatenate(rows), is_reversed=track.is_reversed).rewards
    earned = np.nansum(paid.reshape(PULL_PLACES, len(table.speed), PULL_TICKS + 1)[..., 1:], axis=-1)
    return Pull(arcs, earned, table.spec.labels)


def draw_map(mapped: PayMap, path: Path, title: str) -> None:
    """Draw a map into a picture (.png, .svg or .pdf).

    Raises:
        TrackError: The ending is no picture's.
        OutputFileError: The file cannot be written.
    """
    from racecraft.worlds.deepracer.tracks.picture import draw_track, save_picture

    figure = draw_track(mapped.track, number_every=0, title=title)
    axes = figure.axes[0]
    loop = np.arange(len(mapped.xy) + mapped.track.closed) % len(mapped.xy)
    x, y = mapped.xy[loop, :, 0], mapped.xy[loop, :, 1]
    mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(mapped.pay[loop]), shading="gouraud", cmap="plasma", zorder=3)
    for border in (mapped.track.inner, mapped.track.outer):
        axes.plot(*border.T, color="white", lw=1.2, zorder=5)
    width, height = figure.get_size_inches()
    figure.set_size_inches(width + BAR_IN, height)
    figure.canvas.draw()
    axes.set_anchor("W")
    place = axes.get_position()
    axes.set_position((place.x0, place.y0, place.width * width / (width + BAR_IN), place.height))
    beside = figure.add_axes((1.0 - 0.9 * BAR_IN / (width + BAR_IN), 0.2, 0.15 / (width + BAR_IN), 0.5))
    bar = figure.colorbar(mesh, cax=beside)
    bar.set_label(mapped.what)
    bar.outline.set_visible(False)
    save_picture(figure, path)


def _pairs(track: Track, here: Array, arcs: Array) -> Array:
    """Return two rows a place, each pair an episode that began one tick earlier at its own place."""
    rows = np.zeros(2 * len(here), TICK_REPORT)
    rows[0::2], rows[1::2] = reports_of(track, one_tick_behind(here), laps=False), reports_of(track, here, laps=False)
    gained = (rows["arc"][1::2] - rows["arc"][0::2] + 0.5 * track.length) % track.length - 0.5 * track.length
    rows["progress"][0::2] = 100.0 * arcs / track.length
    rows["progress"][1::2] = rows["progress"][0::2] + 100.0 * gained / track.length
    rows["steps"][0::2], rows["steps"][1::2] = 2.0, 3.0
    rows["time"] = rows["steps"] * TICK_SECONDS
    return rows
