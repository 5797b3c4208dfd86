"""A circuit from above with its cars on it, for films. See `TopMap`."""

from __future__ import annotations

import math

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.films.shells import Shell
from racecraft.worlds.deepracer.analysis.films.solids import FINE, CameraPose, draw_polygons, paint_car
from racecraft.worlds.deepracer.env.kernels.boxes import FIRST_OBJECT
from racecraft.worlds.deepracer.env.light import palette_under
from racecraft.worlds.deepracer.env.scene import FIELD, dash_rings, road_rings, start_rings
from racecraft.worlds.deepracer.tracks.track import Track

PADDING = 0.25
"""Room around the circuit, share of its size (facts: deepracer.md 2.5)."""
UP_M = 60.0
"""From so high a car is as large wherever it is."""
MIN_CAR_PIXELS = 22
"""A car on a large circuit is drawn larger than it is, so that it is seen."""
CAR_LENGTH_M = 0.324


class TopMap:
    """A circuit from above, north up, as large as fits.

    Args:
        track: The circuit.
        light: Year of the simulator whose light falls on it.
        width, height: Pixels.
        foot: Pixels at the foot that something else lies over: the circuit stands in the middle of what is above them.
    """

    def __init__(self, track: Track, light: str, width: int, height: int, foot: int = 0) -> None:
        x0, y0, x1, y1 = track.bounds
        self._scale = min(width / ((1 + PADDING) * (x1 - x0)), height / ((1 + PADDING) * (y1 - y0)))
        self._middle = (x0 + x1) / 2, (y0 + y1) / 2 - 0.5 * foot / self._scale
        self._size = width, height
        self._enlarged = max(1.0, MIN_CAR_PIXELS / (CAR_LENGTH_M * self._scale))
        self._colours = palette_under(light, track.look, track.name, for_people=True).round().astype(int)
        self.picture = self._painted(track)
        """(H, W, 3) uint8."""

    def pixels(self, xy: Array) -> Array:
        """Return where points (P, 2) in metres lie, (P, 2) pixels, x right and y down."""
        width, height = self._size
        return np.column_stack(
            [
                width / 2 + (xy[:, 0] - self._middle[0]) * self._scale,
                height / 2 - (xy[:, 1] - self._middle[1]) * self._scale,
            ]
        )

    def paint_car(self, picture: Array, shell: Shell, pose: tuple[float, float, float]) -> None:
        """Paint a car seen from above."""
        factor, (middle_x, middle_y) = self._enlarged, self._middle
        # Its frame is made smaller around the car, and the focal length larger: the same as a larger car.
        eye = CameraPose(
            pose[0] + (middle_x - pose[0]) / factor,
            pose[1] + (middle_y - pose[1]) / factor,
            UP_M,
            math.pi / 2,
            math.pi / 2,
            UP_M * self._scale * factor,
        )
        paint_car(picture, eye, shell, pose)

    def paint_boxes(self, picture: Array, boxes: Array, kinds: Array) -> None:
        """Paint boxes (K, 6) of kinds (K,) seen from above, as much enlarged as cars are."""
        shapes = []
        for (x, y, yaw, half_length, half_width, _), kind in zip(boxes.tolist(), kinds.tolist(), strict=True):
            along = self._enlarged * half_length * np.array([math.cos(yaw), math.sin(yaw)])
            across = self._enlarged * half_width * np.array([-math.sin(yaw), math.cos(yaw)])
            corners = np.array([(x, y)]) + (along + across, along - across, -along - across, across - along)
            red, green, blue = self._colours[FIRST_OBJECT + kind].tolist()
            shapes.append((self.pixels(corners), (red, green, blue)))
        draw_polygons(picture, shapes, 1.0)

    def _painted(self, track: Track) -> Array:
        from PIL import Image, ImageDraw

        colours = self._colours
        width, height = self._size
        sheet = Image.new("RGB", (FINE * width, FINE * height), tuple(colours[FIELD].tolist()))
        pen = ImageDraw.Draw(sheet)
        for ring, inside, _ in (*road_rings(track), *start_rings(track), *dash_rings(track)):
            pen.polygon(
                [tuple(point) for point in (FINE * self.pixels(ring)).tolist()], tuple(colours[inside].tolist())
            )
        return np.array(sheet.reduce(FINE))
