"""What stands or drives on the road while it is filmed, and in which order it is painted with the cars.

See `filmed_objects` and `back_to_front`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import JUMP_M
from racecraft.worlds.deepracer.analysis.films.moments import Moments
from racecraft.worlds.deepracer.env.kernels.boxes import sort_back_to_front
from racecraft.worlds.deepracer.env.objects import BOT_CAR, KINDS

CAR = KINDS[BOT_CAR]
"""A bot has the measures of any car."""


@dataclass(frozen=True, eq=False)
class FilmedObjects:
    """K boxes and bots in P pictures."""

    boxes: Array
    """(P, K, 6), as `objects.Objects` has them."""
    kinds: Array
    """(P, K) which of `objects.KINDS`."""


def filmed_objects(objects: tuple[Array, Array] | None, taken: Moments) -> FilmedObjects:
    """Return where objects are in every picture: between ticks they move evenly, but where they are placed anew.

    Args:
        objects: In every tick, (T, K, 6) and their kinds (T, K), as `objects.Objects` has them; None: an empty road.
        taken: When the pictures are taken.
    """
    if objects is None:
        return FilmedObjects(np.zeros((len(taken), 0, 6)), np.zeros((len(taken), 0), np.int64))
    boxes, kinds = objects
    step = boxes[np.minimum(taken.ticks + 1, len(boxes) - 1)] - boxes[taken.ticks]
    step[..., 2] = np.arctan2(np.sin(step[..., 2]), np.cos(step[..., 2]))
    slides = np.hypot(step[..., 0], step[..., 1]) < JUMP_M
    return FilmedObjects(
        boxes[taken.ticks] + np.where(slides, taken.past[:, None], 0.0)[..., None] * step, kinds[taken.ticks]
    )


def back_to_front(boxes: Array, poses: Array, eye_x: float, eye_y: float) -> list[int]:
    """Return the order in which K boxes (K, 6) and C cars are painted, so that each hides what stands behind it.

    Args:
        boxes: The objects.
        poses: (C, 3) x, y, yaw of the cars.
        eye_x: Where they are seen from, east, m.
        eye_y: North.

    Returns:
        Numbers of boxes, 0 to K - 1, and of cars, K and on.
    """
    bodies = np.tile((CAR.length / 2, CAR.width / 2, CAR.height), (len(poses), 1))
    everything = np.concatenate([boxes, np.column_stack([poses, bodies])])
    order = np.arange(len(everything))
    sort_back_to_front(everything, order, eye_x, eye_y)
    numbers: list[int] = order.tolist()
    return numbers
