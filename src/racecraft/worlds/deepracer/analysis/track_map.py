"""A small map of a circuit for films: the wall picture of `tracks/picture.py` without its words, and paint for it.

Begin with `TrackMap.of`. Pixels are counted from the upper left corner, x right, y down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.tracks.picture import DARKEST, PATH_COLOURS, draw_track
from racecraft.worlds.deepracer.tracks.track import Track

SHADES = 256


@dataclass(frozen=True, eq=False)
class TrackMap:
    """A circuit in pixels."""

    picture: Array
    """(H, W, 3) uint8, laid over the ground colour asked for."""
    scale: float
    """Pixels in a metre."""
    left: float
    """East of the picture's left edge, m."""
    top: float
    """North of the picture's upper edge, m."""

    @classmethod
    def of(cls, track: Track, width: int, height: int, ground: tuple[int, int, int]) -> TrackMap:
        """Draw a map as large as fits into width x height pixels; `ground` shines through its rounded corners."""
        figure = draw_track(track, number_every=0)
        axes = figure.axes[0]
        for word in [*axes.texts, *axes.lines]:  # the scale bar and its length, too small to be read
            word.remove()
        figure.patch.set_alpha(0.0)
        box = axes.get_window_extent()
        figure.set_dpi(figure.dpi * min(width / box.width, height / box.height))
        figure.canvas.draw()
        rgba = np.asarray(figure.canvas.buffer_rgba()).astype(np.float32)  # type: ignore[attr-defined]
        box = axes.get_window_extent()
        x0, y0 = round(box.x0), round(len(rgba) - box.y1)
        rgba = rgba[y0 : y0 + min(height, round(box.height)), x0 : x0 + min(width, round(box.width))]
        opaque = rgba[..., 3:] / 255.0
        picture = rgba[..., :3] * opaque + np.array(ground, np.float32) * (1.0 - opaque)
        (west, east), (_, north) = axes.get_xlim(), axes.get_ylim()
        return cls(picture.round().astype(np.uint8), box.width / (east - west), west, north)

    def pixels(self, xy: Array) -> Array:
        """Return where points (T, 2) in metres lie on the picture, (T, 2) pixels."""
        return np.column_stack([(xy[:, 0] - self.left) * self.scale, (self.top - xy[:, 1]) * self.scale])


def dab(picture: Array, x: float, y: float, radius: float, colour: tuple[int, int, int]) -> None:
    """Put a round dab of colour with a soft edge on a picture (H, W, 3) uint8, in place."""
    reach = math.ceil(radius) + 1
    x0, x1 = max(0, int(x) - reach), min(picture.shape[1], int(x) + reach + 1)
    y0, y1 = max(0, int(y) - reach), min(picture.shape[0], int(y) + reach + 1)
    if x0 >= x1 or y0 >= y1:
        return
    across = np.arange(x0, x1, dtype=np.float32) + np.float32(0.5 - x)
    down = np.arange(y0, y1, dtype=np.float32) + np.float32(0.5 - y)
    cover = np.clip(radius + 0.5 - np.sqrt(across[None, :] ** 2 + down[:, None] ** 2), 0.0, 1.0)[..., None]
    patch = picture[y0:y1, x0:x1]
    patch[:] = (patch + cover * (np.array(colour, np.float32) - patch) + 0.5).astype(np.uint8)


@lru_cache(maxsize=1)
def speed_shades() -> Array:
    """Return the colours of slow to fast, (SHADES, 3) uint8: those of paths in track pictures."""
    from matplotlib import colormaps

    return (255 * colormaps[PATH_COLOURS](np.linspace(DARKEST, 1.0, SHADES))[:, :3]).round().astype(np.uint8)
