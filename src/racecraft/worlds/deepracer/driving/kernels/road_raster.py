"""The road as a raster of small cells, so that most points need no test against its borders."""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, lean_kernel
from racecraft.worlds.deepracer.env.vehicle import FRONT_WHEELS_M, REAR_WHEELS_M
from racecraft.worlds.deepracer.tracks.kernels.geometry import is_on_road

CELL_M = 0.01
OUTSIDE, INSIDE, NEAR_BORDER = 0, 1, 2
REAR_X, REAR_Y = REAR_WHEELS_M
FRONT_X, FRONT_Y = FRONT_WHEELS_M


@kernel
def fill_raster(shell, hole, x0, y0, cells):
    """Fill `cells` uint8 (rows, columns) with OUTSIDE, INSIDE or NEAR_BORDER; cell (0, 0) begins at (x0, y0) m."""
    _fill_ring(shell, x0, y0, cells, INSIDE)
    hole_cells = np.zeros_like(cells)
    _fill_ring(hole, x0, y0, hole_cells, INSIDE)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if hole_cells[row, column] == INSIDE:
                cells[row, column] = OUTSIDE
    _mark_border(shell, x0, y0, cells)
    _mark_border(hole, x0, y0, cells)


@kernel
def _fill_ring(ring, x0, y0, cells, value):
    """Toggle every cell whose centre lies inside the ring, row by row between crossings."""
    crossings = np.empty(ring.shape[0])
    for row in range(cells.shape[0]):
        y = y0 + (row + 0.5) * CELL_M
        count = 0
        for i in range(ring.shape[0] - 1):
            ay, by = ring[i, 1], ring[i + 1, 1]
            if (ay > y) != (by > y):
                crossings[count] = ring[i, 0] + (y - ay) / (by - ay) * (ring[i + 1, 0] - ring[i, 0])
                count += 1
        crossings[:count].sort()
        for k in range(0, count - 1, 2):
            first = int(math.ceil((crossings[k] - x0) / CELL_M - 0.5))
            last = int(math.floor((crossings[k + 1] - x0) / CELL_M - 0.5))
            for column in range(max(first, 0), min(last + 1, cells.shape[1])):
                cells[row, column] = value


@kernel
def _mark_border(ring, x0, y0, cells):
    """Mark each cell that a ring passes, and its neighbours."""
    for i in range(ring.shape[0] - 1):
        dx, dy = ring[i + 1, 0] - ring[i, 0], ring[i + 1, 1] - ring[i, 1]
        steps = int(math.hypot(dx, dy) / (0.5 * CELL_M)) + 1
        for k in range(steps + 1):
            column = int((ring[i, 0] + k / steps * dx - x0) / CELL_M)
            row = int((ring[i, 1] + k / steps * dy - y0) / CELL_M)
            for r in range(max(row - 1, 0), min(row + 2, cells.shape[0])):
                for c in range(max(column - 1, 0), min(column + 2, cells.shape[1])):
                    cells[r, c] = NEAR_BORDER


@lean_kernel
def has_wheel_on_road(track, x0, y0, cells, x, y, yaw):
    """Tell whether at least one wheel centre of a car lies strictly inside the road, as marshals count it."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    for wanted in (INSIDE, NEAR_BORDER):  # one wheel well inside spares the exact test of those near a border
        for ahead, left in ((REAR_X, REAR_Y), (FRONT_X, FRONT_Y), (REAR_X, -REAR_Y), (FRONT_X, -FRONT_Y)):
            wheel_x, wheel_y = x + cos * ahead - sin * left, y + sin * ahead + cos * left
            column, row = int((wheel_x - x0) / CELL_M), int((wheel_y - y0) / CELL_M)
            is_wanted = 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1] and cells[row, column] == wanted
            if is_wanted and (wanted == INSIDE or is_on_road(track, wheel_x, wheel_y)):
                return True
    return False
