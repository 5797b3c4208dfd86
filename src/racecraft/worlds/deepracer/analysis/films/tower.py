"""Who leads, at the side of a race's film: a row a car, the leader's on top, as television has it. See `Tower`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import QUIET, WHITE, fitted, font
from racecraft.worlds.deepracer.analysis.films.figures import STRIP_TOPS, strip_height
from racecraft.worlds.deepracer.analysis.films.shells import RGB

ROW_SHARE, WIDTH_SHARE, LEFT_SHARE = 0.36, 0.19, 0.02
"""Height of a row, share of the figures' strip; width and left edge of the tower, shares of the picture's width."""
VEIL = 0.72
"""How dark the ground below it becomes."""


@dataclass(frozen=True, eq=False)
class Standings:
    """M cars of one race, in the order of their numbers; the first is filmed."""

    places: Array
    """(T, M) the place of each in every tick, 1 for the leader; equal where nothing tells two apart."""
    names: tuple[str, ...]
    paints: tuple[RGB, ...]
    """Of their shells."""

    def order(self, tick: int) -> list[int]:
        """Return the cars' numbers in a tick, the leader's first."""
        order: list[int] = np.argsort(self.places[min(tick, len(self.places) - 1)], kind="stable").tolist()
        return order


class Tower:
    """Lays the order of a race over pictures of one size."""

    def __init__(self, standings: Standings, width: int, height: int) -> None:
        strip = strip_height(width, height)
        self._standings, self._row = standings, round(ROW_SHARE * strip)
        self._left, self._top, self._width = round(LEFT_SHARE * width), STRIP_TOPS * strip, round(WIDTH_SHARE * width)
        size = max(9, round(0.6 * self._row))
        self._plain, self._bold = font(size), font(size, bold=True)

    def draw_on(self, tick: int, picture: Array) -> None:
        """Lay the order of a tick over a picture (H, W, 3) uint8, in place."""
        from PIL import Image, ImageDraw

        order, row = self._standings.order(tick), self._row
        band = picture[self._top : self._top + row * len(order), self._left : self._left + self._width]
        band[:] = (band * (1.0 - VEIL)).astype(np.uint8)
        sheet = Image.fromarray(band)
        pen = ImageDraw.Draw(sheet)
        for place, car in enumerate(order):
            face, ink = (self._bold, WHITE) if car == 0 else (self._plain, QUIET)
            middle, chip = (place + 0.5) * row, max(3, row // 6)
            pen.rectangle((0, place * row, chip, (place + 1) * row - 2), self._standings.paints[car])
            pen.text((chip + 0.75 * row, middle), str(place + 1), ink, face, "mm")
            left = chip + 1.4 * row
            pen.text((left, middle), fitted(self._standings.names[car], face, self._width - left), ink, face, "lm")
        band[:] = np.asarray(sheet)
