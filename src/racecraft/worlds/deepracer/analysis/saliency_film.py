"""A look as a film: the camera, what counted in it, what the network found there; below what it chose and how sure.

Begin with `write_saliency_film`. Without a drive, as of a folder of pictures, the map is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.analysis.video import encode_film, film_path
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import GROUND, QUIET, SLOT, STEER, WHITE, fitted, font
from racecraft.worlds.deepracer.analysis.lap_film import PICTURES_PER_SECOND
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries, glowing, shining
from racecraft.worlds.deepracer.analysis.track_map import TrackMap, dab
from racecraft.worlds.deepracer.env.sensors import STEREO
from racecraft.worlds.deepracer.tracks.track import Track

WIDTH, HEIGHT = 960, 540
EYE = (312, 234)
"""Pixels of each of the three pictures, 4 : 3."""
TOP, GAP = 40, 6
EYES = ("the camera", "what counted (integrated gradients)", "where it found it (Grad-CAM)")
PAIR = ("the right eye", "what counted, of both eyes (integrated gradients)", EYES[2])
"""The same words where two eyes are told as one picture."""
BELOW = TOP + EYE[1] + 28
STILL_SECONDS = 2.0
"""How long a single picture stays where pictures do not follow each other."""


@dataclass(frozen=True, eq=False)
class CarPositions:
    """Where the car was at each picture."""

    track: Track
    xy: Array
    """(T, 2) m."""


def write_saliency_film(
    path: str | Path, look: SaliencySeries, title: str, place: CarPositions | None = None, still: bool = False
) -> Path:
    """Film a look.

    Args:
        path: File to write, .mp4; it arrives whole.
        look: The pictures.
        title: Headline.
        place: Where the car was, for the map.
        still: Pictures do not follow each other; each stays STILL_SECONDS.

    Raises:
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
        OutputFileError: The place cannot be written.
    """
    path = film_path(path)
    rate = 1.0 / STILL_SECONDS if still else PICTURES_PER_SECOND
    encode_film(path, look_pictures(look, title, place), rate, title)
    return path


def look_pictures(look: SaliencySeries, title: str, place: CarPositions | None = None) -> Iterator[Array]:
    """Yield the film's pictures, (HEIGHT, WIDTH, 3) uint8."""
    from PIL import Image, ImageDraw

    plain = _plain(look, title)
    line = _Line(look)
    track_map = None if place is None else _Map(place)
    heats = [shining(look.heat)] + ([] if look.cam is None else [shining(look.cam)])
    for row in range(len(look)):
        picture = plain.copy()
        pen = ImageDraw.Draw(picture)
        _write_choice(pen, look, row)
        line.mark(pen, row)
        canvas = np.array(picture)
        eye = Image.fromarray(look.frames[row]).resize(EYE, Image.Resampling.NEAREST).convert("RGB")
        eyes = [np.asarray(eye), *(glowing(look.frames[row], heat[row], EYE) for heat in heats)]
        for number, view in enumerate(eyes):
            left = _left(number)
            canvas[TOP : TOP + EYE[1], left : left + EYE[0]] = view
        if track_map is not None:
            track_map.draw_on(canvas, row)
        yield canvas


def _left(number: int) -> int:
    return GAP + number * (EYE[0] + GAP)


def _plain(look: SaliencySeries, title: str) -> Any:
    """Return what never changes."""
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (WIDTH, HEIGHT), GROUND)
    pen = ImageDraw.Draw(picture)
    pen.text((GAP + 2, 10), fitted(title, font(17, bold=True), WIDTH - 2 * GAP), WHITE, font(17, bold=True))
    names = PAIR if look.name == STEREO else EYES
    for number, words in enumerate(names[: 2 if look.cam is None else 3]):
        pen.text((_left(number) + 2, TOP + EYE[1] + 4), words, QUIET, font(12))
    return picture


def _write_choice(pen: Any, look: SaliencySeries, row: int) -> None:
    """Write what was chosen, two bars."""
    left, width = GAP + 10, EYE[0] - 20
    is_choice = bool(look.labels)
    for number, (what, share, words) in enumerate(look.decision(row)):
        y = BELOW + 12 + 62 * number
        head = ("chosen", "second best")[number] + ": " if is_choice else ""
        pen.text((left, y), fitted(head + what, font(14), width - 70), WHITE if number == 0 else QUIET, font(14))
        pen.text((left + width, y), words, WHITE, font(14, bold=True), anchor="ra")
        pen.rectangle((left, y + 24, left + width, y + 38), SLOT)
        begin, end = (0.0, share) if is_choice else (min(0.5, share), max(0.5, share))
        if look.actions.shape and number == 0:  # a number's bar grows from the middle, left is left
            begin, end = 1.0 - end, 1.0 - begin
        if end > begin:
            pen.rectangle((left + begin * width, y + 24, left + end * width, y + 38), STEER if number == 0 else QUIET)


class _Line:
    """What goes along all pictures, how sure it was or what it chose, with a mark that moves."""

    def __init__(self, look: SaliencySeries) -> None:
        self._along = along = look.along
        spread = np.zeros(len(look)) if along.spread is None else along.spread
        self._left, self._right = _left(1), _left(1) + EYE[0]
        self._top, self._bottom = BELOW + 30, HEIGHT - 36
        self._low = min(0.0, float((along.values - spread).min()))
        self._high = max(float((along.values + spread).max()), self._low + 1e-9)
        x = self._left + (self._right - self._left) * np.arange(len(look)) / max(1, len(look) - 1)
        self._points = np.column_stack([x, self._height(along.values)])
        upper, lower = (np.column_stack([x, self._height(along.values + side * spread)]) for side in (1, -1))
        self._band = [] if along.spread is None else [tuple(point) for point in (*upper, *lower[::-1])]

    def _height(self, values: Any) -> Any:
        share = (values - self._low) / (self._high - self._low)
        return self._bottom - share * (self._bottom - self._top)

    def mark(self, pen: Any, row: int) -> None:
        """Draw the line and where the film is."""
        pen.text((self._left, BELOW + 6), fitted(self._along.label, font(12), EYE[0]), QUIET, font(12))
        if len(self._band) > 2:
            pen.polygon(self._band, SLOT)
        zero = float(self._height(0.0))
        pen.line((self._left, zero, self._right, zero), SLOT if not self._band else GROUND, 1)
        pen.line([tuple(point) for point in self._points], QUIET, 1)
        x, y = self._points[row]
        pen.line((x, self._top, x, self._bottom), SLOT if not self._band else QUIET, 1)
        pen.ellipse((x - 4, y - 4, x + 4, y + 4), WHITE)
        pen.text((self._left, self._bottom + 6), self._along.told[row], WHITE, font(14, bold=True))


class _Map:
    """The map with the car on it."""

    def __init__(self, place: CarPositions) -> None:
        room = (EYE[0] - 20, HEIGHT - BELOW - 20)
        self._map = TrackMap.of(place.track, *room, GROUND)
        self._xy = self._map.pixels(place.xy)
        height, width = self._map.picture.shape[:2]
        self._left = _left(2) + 10 + (room[0] - width) // 2
        self._top = BELOW + (room[1] - height) // 2

    def draw_on(self, canvas: Array, row: int) -> None:
        """Lay the map on a picture, in place."""
        picture = self._map.picture.copy()
        x, y = self._xy[row]
        dab(picture, x, y, 5.0, GROUND)
        dab(picture, x, y, 3.6, WHITE)
        height, width = picture.shape[:2]
        canvas[self._top : self._top + height, self._left : self._left + width] = picture
