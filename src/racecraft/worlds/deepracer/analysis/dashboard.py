"""The panel beside a film's camera view: map, lap, progress, speed, steering. Begin with `Dashboard.draw`.

What never changes is drawn once; a tick redraws a few words and bars.
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.drive import LAP_COMPLETE, Drive
from racecraft.worlds.deepracer.analysis.track_map import SHADES, TrackMap, dab, speed_shades
from racecraft.worlds.deepracer.tracks.track import Track

RGB = tuple[int, int, int]

GROUND: RGB = (17, 22, 27)
SLOT: RGB = (44, 52, 60)
"""Where a bar is empty."""
WHITE: RGB = (244, 246, 248)
QUIET: RGB = (150, 160, 170)
GOOD: RGB = (46, 144, 214)
"""Blue of what went well: told from BAD by colour-blind eyes too."""
BAD: RGB = (226, 112, 34)
STEER: RGB = (86, 190, 170)
BOX: RGB = (214, 170, 120)
"""What stands or drives on the road besides."""

MARGIN = 16
MAP_HEIGHT = 176
MAP_TOP, GHOST_TOP, LAP_TOP, SPEED_TOP, STEERING_TOP = 66, 244, 264, 370, 464
BAR_HEIGHT = 12
TRAIL_RADIUS, CAR_RADIUS, BOX_RADIUS = 1.7, 4.6, 3.8
JUMP_M = 0.6
"""A car that moved further in a tick was set down elsewhere; its trail has a gap there."""
BANNER_HEIGHT = 84
BANNER_FOOT = 48
"""Pixels of the view that stay free below a banner."""


class Dashboard:
    """Draws the panel of every tick of a drive, in order.

    Args:
        track: The circuit, as it was driven.
        drive: What the car did.
        title: Headline; the track's name when empty.
        width, height: Pixels of the panel.
        boxes: Boxes and bots in every tick, (T, K, 6), as `objects.Objects` has them; None: an empty road.
        ghost: An earlier drive of the same car, shown on the map from the same moment on; None: the car is alone.
    """

    def __init__(
        self,
        track: Track,
        drive: Drive,
        title: str,
        width: int,
        height: int,
        boxes: Array | None = None,
        ghost: Drive | None = None,
    ) -> None:
        self._drive, self._ghost = drive, ghost
        self._boxes = boxes
        self._inside = width - 2 * MARGIN
        self._map = TrackMap.of(track, self._inside, MAP_HEIGHT, GROUND)
        self._map_left = MARGIN + (self._inside - self._map.picture.shape[1]) // 2
        self._map_top = MAP_TOP + (MAP_HEIGHT - self._map.picture.shape[0]) // 2
        self._places = self._map.pixels(drive.xy)
        self._ghost_places = None if ghost is None else self._map.pixels(ghost.xy)
        self._top_mps = speed_scale_end(drive)
        self._top_rad = max(math.radians(30.0), float(np.abs(drive.steering_rad).max()))
        shade = (SHADES - 1) * np.clip(drive.driven_mps / self._top_mps, 0.0, 1.0)
        self._colours = speed_shades()[shade.astype(int)]
        self._trail = self._map.picture.copy()
        self._next_tick = 0
        self._plain = self._draw_plain(track, title, width, height)

    def draw(self, tick: int, panel: Array) -> None:
        """Draw a tick into panel (H, W, 3) uint8; ticks come in rising order."""
        from PIL import ImageDraw

        picture = self._plain.copy()
        pen = ImageDraw.Draw(picture)
        self._draw_lap(pen, tick)
        self._draw_speed(pen, tick)
        self._draw_steering(pen, tick)
        panel[:] = np.asarray(picture)
        self._extend_trail(tick)
        height, width = self._trail.shape[:2]
        place = panel[self._map_top : self._map_top + height, self._map_left : self._map_left + width]
        place[:] = self._trail
        for box in () if self._boxes is None else self._map.pixels(self._boxes[tick, :, :2]):
            dab(place, box[0], box[1], BOX_RADIUS, GROUND)
            dab(place, box[0], box[1], BOX_RADIUS - 1.0, BOX)
        if self._ghost_places is not None:
            x, y = self._ghost_places[min(tick, len(self._ghost_places) - 1)]
            dab(place, x, y, CAR_RADIUS, GROUND)
            dab(place, x, y, CAR_RADIUS - 1.4, BAD)
        x, y = self._places[tick]
        dab(place, x, y, CAR_RADIUS, GROUND)
        dab(place, x, y, CAR_RADIUS - 1.4, WHITE)

    def banner(self, row: int, width: int) -> Array:
        """Return the strip that says how the drive stood at a row that ended something, (BANNER_HEIGHT, width, 3)."""
        from PIL import Image, ImageDraw

        words = self._drive.outcome(row)
        colour = GOOD if self._drive.status[row] == LAP_COMPLETE else BAD
        strip = Image.new("RGB", (width, BANNER_HEIGHT), colour)
        words = words[:1].upper() + words[1:]
        ImageDraw.Draw(strip).text((width / 2, BANNER_HEIGHT / 2), words, WHITE, font(38, bold=True), anchor="mm")
        return np.asarray(strip)

    def _draw_plain(self, track: Track, title: str, width: int, height: int) -> Any:
        from PIL import Image, ImageDraw

        picture = Image.new("RGB", (width, height), GROUND)
        pen = ImageDraw.Draw(picture)
        name = track.title or track.name
        pen.text((MARGIN, 14), fitted(title or name, font(17, bold=True), self._inside), WHITE, font(17, bold=True))
        below = name if title else f"{track.length:.1f} m"
        pen.text((MARGIN, 38), fitted(below, font(13), self._inside), QUIET, font(13))
        if self._ghost is not None:
            words = f"● first full lap, {self._ghost.lap_seconds[-1]:.2f} s"
            pen.text((MARGIN, GHOST_TOP), words, BAD, font(12))
        pen.text((MARGIN, SPEED_TOP), "SPEED", QUIET, font(12))
        pen.text((MARGIN, STEERING_TOP), "STEERING", QUIET, font(12))
        return picture

    def _draw_lap(self, pen: Any, tick: int) -> None:
        drive, right = self._drive, MARGIN + self._inside
        pen.text((MARGIN, LAP_TOP), f"LAP {drive.lap[tick]}", QUIET, font(12))
        pen.text((MARGIN, LAP_TOP + 52), f"{drive.lap_seconds[tick]:.2f}", WHITE, font(36, bold=True), anchor="ls")
        x = MARGIN + font(36, bold=True).getlength(f"{drive.lap_seconds[tick]:.2f}") + 6
        pen.text((x, LAP_TOP + 52), "s", QUIET, font(18), anchor="ls")
        percent = float(drive.progress_percent[tick])
        pen.text((right, LAP_TOP + 52), f"{percent:.0f} %", WHITE, font(18), anchor="rs")
        self._bar(pen, LAP_TOP + 68, 0.0, percent / 100.0, WHITE)

    def _draw_speed(self, pen: Any, tick: int) -> None:
        drive, right = self._drive, MARGIN + self._inside
        driven, commanded = float(drive.driven_mps[tick]), float(drive.commanded_mps[tick])
        pen.text((MARGIN, SPEED_TOP + 45), f"{driven:.2f}", WHITE, font(26, bold=True), anchor="ls")
        pen.text((MARGIN + 66, SPEED_TOP + 45), "m/s", QUIET, font(14), anchor="ls")
        pen.text((right, SPEED_TOP + 45), f"told {commanded:.2f}", QUIET, font(14), anchor="rs")
        r, g, b = (int(part) for part in self._colours[tick])
        self._bar(pen, SPEED_TOP + 56, 0.0, driven / self._top_mps, (r, g, b))
        x = MARGIN + min(1.0, commanded / self._top_mps) * self._inside
        pen.rectangle((x - 1.5, SPEED_TOP + 53, x + 0.5, SPEED_TOP + 58 + BAR_HEIGHT), WHITE)

    def _draw_steering(self, pen: Any, tick: int) -> None:
        angle = float(self._drive.steering_rad[tick])
        degrees = round(math.degrees(angle))
        words = "straight" if degrees == 0 else f"{abs(degrees)}° {'left' if degrees > 0 else 'right'}"
        pen.text((MARGIN + self._inside, STEERING_TOP - 3), words, WHITE, font(16), anchor="ra")
        reach = 0.5 - 0.5 * angle / self._top_rad  # left turns fill to the left
        self._bar(pen, STEERING_TOP + 26, min(reach, 0.5), max(reach, 0.5), STEER)
        x = MARGIN + self._inside / 2
        pen.rectangle((x - 1, STEERING_TOP + 23, x, STEERING_TOP + 28 + BAR_HEIGHT), WHITE)

    def _bar(self, pen: Any, y: int, begin: float, end: float, colour: RGB) -> None:
        """Draw a slot over the panel's width, filled between two shares of it."""
        right = MARGIN + self._inside - 1
        pen.rectangle((MARGIN, y, right, y + BAR_HEIGHT - 1), SLOT)
        first, last = (MARGIN + round(min(1.0, max(0.0, share)) * self._inside) for share in (begin, end))
        if last > first:
            pen.rectangle((first, y, last - 1, y + BAR_HEIGHT - 1), colour)

    def _extend_trail(self, tick: int) -> None:
        """Paint the trail up to a tick; a new lap wipes off the one before."""
        drive = self._drive
        for t in range(self._next_tick, tick + 1):
            fresh = t == 0 or drive.lap[t] != drive.lap[t - 1]
            if fresh:
                self._trail[:] = self._map.picture
            colour = tuple(int(part) for part in self._colours[t])
            begin = t if fresh or self._jumped(t) else t - 1
            steps = max(1, math.ceil(math.dist(self._places[begin], self._places[t])))
            for share in np.arange(1, steps + 1) / steps:
                x, y = self._places[begin] + share * (self._places[t] - self._places[begin])
                dab(self._trail, x, y, TRAIL_RADIUS, colour)  # type: ignore[arg-type]
        self._next_tick = max(self._next_tick, tick + 1)

    def _jumped(self, tick: int) -> bool:
        return math.dist(self._drive.xy[tick - 1], self._drive.xy[tick]) > JUMP_M


def lay_banner(view: Array, strip: Array) -> None:
    """Lay a strip over the lower part of a camera view (H, W, 3) uint8, in place."""
    bottom = len(view) - BANNER_FOOT
    view[bottom - len(strip) : bottom] = strip


def speed_scale_end(drive: Drive) -> float:
    """Return the end of the speed scale, m/s: the next half over what was told and driven, at least 1."""
    return max(1.0, 0.5 * math.ceil(2.0 * max(float(drive.commanded_mps.max()), float(drive.driven_mps.max()) - 0.1)))


@lru_cache(maxsize=16)
def font(size: int, bold: bool = False) -> Any:
    """Return the typeface that comes with matplotlib; its figures are all of one width."""
    import matplotlib
    from PIL import ImageFont

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def fitted(text: str, face: Any, width: float) -> str:
    """Return the text, cut with an ellipsis where it is wider than so many pixels."""
    if face.getlength(text) <= width:
        return text
    while text and face.getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"
