"""The figures over a film's picture: name, lap, time, speed, progress, resets and penalties. See `Overlay`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import BAD, GOOD, QUIET, WHITE, fitted, font
from racecraft.worlds.deepracer.analysis.drive import LAP_COMPLETE, PAUSE, Drive
from racecraft.worlds.deepracer.analysis.films.moments import HELD_SECONDS
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

STRIP_SHARE, STRIP_OF_WIDTH, VEIL = 0.115, 0.07, 0.68
"""Height of the strip at the foot, share of the picture's height, at most this share of its width; how dark it is."""

STRIP_TOPS = 2
"""Heights of the strip that a banner at the top takes, with what is free above and below it."""
BANNER_SHARE = 0.66
"""Width of the banner, share of the picture's: the rest is the small picture's."""

WIDEST, MIN_SIZE = "00.00 m/s", 10
"""The widest of the figures; px of the smallest letters: what is wider then is cut."""


class Overlay:
    """Lays a drive's figures over pictures of one size.

    Args:
        drive: What the car did.
        name: Who drives.
        width, height: Pixels.
    """

    def __init__(self, drive: Drive, name: str, width: int, height: int) -> None:
        self._drive, self._name, self._width = drive, name, width
        self._strip = strip_height(width, height)
        self._share = 0.96 * width / (len(self.words(0)) + 1.6)
        self._small = font(max(9, round(0.24 * self._strip)))
        self._large = _bold_within(WIDEST, 0.94 * self._share, 0.42 * self._strip)
        self._banner = font(max(12, round(0.5 * self._strip)), bold=True)
        self._title = _bold_within(name, 1.5 * self._share, 0.5 * self._strip)

    def draw_on(self, tick: int, picture: Array) -> None:
        """Lay the figures of a tick over a picture (H, W, 3) uint8, in place."""
        from PIL import Image, ImageDraw

        foot = picture[-self._strip :]
        foot[:] = (foot * (1.0 - VEIL)).astype(np.uint8)
        sheet = Image.fromarray(foot)
        pen = ImageDraw.Draw(sheet)
        left, share = round(0.02 * self._width), self._share
        pen.text((left, self._strip * 0.5), fitted(self._name, self._title, 1.5 * share), WHITE, self._title, "lm")
        for k, (label, value) in enumerate(self.words(tick)):
            x = left + (k + 1.6) * share
            pen.text((x, self._strip * 0.12), label, QUIET, self._small)
            pen.text((x, self._strip * 0.9), fitted(value, self._large, share), WHITE, self._large, "ls")
        foot[:] = np.asarray(sheet)
        self._draw_banner(tick, picture)

    def words(self, tick: int) -> Sequence[tuple[str, str]]:
        """Return the figures of a tick: what it is, how much."""
        drive = self._drive
        lines = [
            ("LAP", str(int(drive.lap[tick]))) if drive.trial is None else ("TRIAL", str(int(drive.trial[tick]))),
            ("TIME", f"{drive.lap_seconds[tick]:.1f} s"),
            ("SPEED", f"{drive.driven_mps[tick]:.2f} m/s"),
            ("PROGRESS", f"{drive.progress_percent[tick]:.0f} %"),
        ]
        if drive.resets is not None and drive.penalty_seconds is not None:
            lines += [("RESETS", str(int(drive.resets[tick]))), ("PENALTY", f"{drive.penalty_seconds[tick]:.0f} s")]
        return lines

    def _draw_banner(self, tick: int, picture: Array) -> None:
        """Say at the top what has just ended, or that the car waits; a small picture in the corner stays free."""
        drive = self._drive
        ended = drive.endings[(drive.endings <= tick) & (drive.endings > tick - HELD_SECONDS * TICKS_PER_SECOND)]
        if not len(ended):
            return
        row = int(ended[-1])
        words = drive.outcome(row)
        if drive.status[tick] == PAUSE:
            words += ", waiting"
        good = drive.status[row] == LAP_COMPLETE
        self._paint_banner(picture, words[:1].upper() + words[1:], GOOD if good else BAD)

    def _paint_banner(self, picture: Array, words: str, colour: Any) -> None:
        from PIL import Image, ImageDraw

        top = self._strip // 2
        band = picture[top : top + self._strip, : round(BANNER_SHARE * self._width)]
        sheet = Image.new("RGB", (band.shape[1], band.shape[0]), colour)
        ImageDraw.Draw(sheet).text((band.shape[1] / 2, band.shape[0] / 2), words, WHITE, self._banner, anchor="mm")
        band[:] = np.asarray(sheet)


def strip_height(width: int, height: int) -> int:
    """Return how high the strip of figures at the foot of a picture is, pixels."""
    return round(min(STRIP_SHARE * height, STRIP_OF_WIDTH * width))


def _bold_within(text: str, width: float, most: float) -> Any:
    """Return the largest bold letters, at most so many px, in which a text is no wider than so many px."""
    size = max(MIN_SIZE, round(most))
    while size > MIN_SIZE and font(size, bold=True).getlength(text) > width:
        size -= 1
    return font(size, bold=True)
