"""What stands or drives on the road beside the cars: boxes and bots, as upright oriented boxes. Begin with `Objects`.

Every world has K of them, and K is the same in all worlds; a race without objects has K = 0 and pays nothing::

    boxes   float64 (N, K, 6)   x, y (m), yaw (rad), half length, half width, height (m); they stand on the ground
    kinds   int64 (N, K)        which of `KINDS`: how it is painted
    states  OBJECT_STATE (N, K) where it lies along the track, and what a bot is doing

`boxes` is what everybody looks at: collisions, the camera, range finders. `kernels/objects.py` has the
geometry, `kernels/placing.py` where they go, `kernels/bots.py` the driving, `placing.py` what a race asks for.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.tracks.track import Track


class Kind(NamedTuple):
    """How a kind of object is built."""

    name: str
    length: float
    """m along its own yaw."""
    width: float
    """m across."""
    height: float
    """m."""
    colour: tuple[float, float, float]
    """RGB of its paint, 0 to 255, before any light falls on it."""


KINDS = (
    Kind("box_obstacle", 0.40, 0.30, 0.25, (122.9, 96.9, 78.8)),
    Kind("deepracer_box_obstacle", 0.36, 0.265, 0.24, (122.9, 96.9, 78.8)),
    Kind("amazon_box_obstacle", 0.40, 0.30, 0.25, (181.0, 141.0, 99.0)),
    Kind("bot_car", 0.32352, 0.1961, 0.195, (39.8, 39.8, 39.8)),
)
"""The code of a kind is its index. Sizes, the brown of a box and the grey of a bot: facts: deepracer.md 6.1, 6.2, 1.1.
The two other boxes are printed; the facts hold no picture of them, so they are plain: brown, and cardboard."""
BOX, DEEPRACER_BOX, AMAZON_BOX, BOT_CAR = range(len(KINDS))
BOX_TYPES = tuple(kind.name for kind in KINDS[:BOT_CAR])

LANE = 0.5
"""Objects stand or drive so far beside the centre line, share of the half road (facts 6.1: the middle of a lane)."""
CLEAR_AHEAD_M = 1.5
"""Random places leave so much of the centre line free before a car's start, middle to middle."""
CLEAR_BEHIND_M = 1.1
"""And so much behind it, for every car of the world."""
FIXED_END_M = 1.0
"""The last of the fixed places lies so far before the end of the lap (facts 6.1)."""

OBJECT_STATE = np.dtype(
    [
        ("arc", "f8"),  # m from the start line along the centre line
        ("centre_distance", "f8"),  # m, never negative
        ("is_left", "b1"),  # of the centre line, in driving direction
        ("lane", "f8"),  # share of the half road it stands or drives beside the centre line, left positive
        ("driven", "f8"),  # of a bot: m along the centre line that its lane's spline is at
        ("next_lane", "f8"),  # of a bot that changes lanes: where to; else as `lane`
        ("change_driven", "f8"),  # m of the lane change behind it; negative while it keeps its lane
        ("change_in", "f8"),  # s until the next change begins
        ("pause", "f8"),  # s it will still stand
        ("changes", "i8"),  # lane changes begun since the race was reset: counts its draws
        ("speed", "f8"),  # of another car: m/s that it drives; its `driven` is the arc of its nose
    ]
)  # fmt: skip
"""One object beside its box. The two together are all it needs to go on."""


class ObjectPlan(NamedTuple):
    """What a race asks for, the same in all worlds, as kernels take it."""

    sizes: Array
    """(K, 3) half length, half width, height, m."""
    kinds: Array
    """(K,) int64."""
    arcs: Array
    """(K,) m along the centre line: fixed places, or where random ones are drawn from with fidelity aws."""
    lanes: Array
    """(K,) share of the half road, left positive, of fixed places."""
    speed: float
    """m/s of bots; 0 where nothing moves."""
    is_random: bool
    """Every episode has places of its own."""
    slips: bool
    """The least distance is taken per cent of the lap, and again of that at every placing (`fidelity.py`)."""
    corners_only: bool
    """A car touches a box where one of its corners lies inside, with 0.05 m to spare (`fidelity.py`)."""
    blames_by_lap: bool
    """Who ran into whom is told by the place on the lap, wherever the start line lies (`fidelity.py`)."""
    least_distance: float
    """m along the centre line between neighbours that are placed at random."""
    changes_lanes: bool
    change_after_low: float
    change_after_high: float
    """s, least and most, that a bot keeps a lane."""
    change_distance: float
    """m along the centre line that a change of lanes takes."""
    knots: Array
    """(R,) m along the centre line: where a piece of a lane's spline begins; (0,) where nothing moves."""
    cubics: Array
    """(2, R - 1, 2, 4): x and y in each piece of the right and the left lane (`lanes.py`)."""
    penalty: float
    """s for which bots stand after one of them ran into a car."""


class Objects(NamedTuple):
    """All objects of N worlds, in one argument for kernels."""

    boxes: Array
    """(N, K, 6)."""
    kinds: Array
    """(N, K)."""
    paints: Array
    """(N, K) int64: which row of a palette, behind those of the circuit, each is painted with; as a rule its kind's."""
    states: Array
    """OBJECT_STATE (N, K)."""
    keys: Array
    """(N, 2) uint64, each world's streams of chance: of places, and of lane changes."""


class Nearby(NamedTuple):
    """What every car of N worlds finds in its way: J = K + M - 1 rows, its world's objects before the other cars."""

    boxes: Array
    """(N, M, J, 6)."""
    kinds: Array
    """(N, M, J)."""
    paints: Array
    """(N, M, J), as `Objects.paints`."""
    states: Array
    """OBJECT_STATE (N, M, J)."""
    counts: Array
    """(N, M) int64, how many of the J rows count: a parked car is nowhere."""
    bodies: Array
    """(N, M, 6), every car as a box."""
    body_states: Array
    """OBJECT_STATE (N, M), and where it lies."""


def new_around(objects: Objects, cars_per_world: int) -> Nearby:
    """Return what cars find around them before anybody looks; a car alone finds the very arrays of its objects."""
    num_worlds, num_objects = objects.kinds.shape
    own = (num_worlds, cars_per_world)
    bodies = np.zeros((*own, 6))
    car = KINDS[BOT_CAR]
    bodies[..., 3:] = car.length / 2, car.width / 2, car.height
    counts, body_states = np.full(own, num_objects), np.zeros(own, OBJECT_STATE)
    if cars_per_world == 1:
        boxes, kinds, paints = objects.boxes[:, None], objects.kinds[:, None], objects.paints[:, None]
        return Nearby(boxes, kinds, paints, objects.states[:, None], counts, bodies, body_states)
    rows = (*own, num_objects + cars_per_world - 1)
    kinds, paints = np.full(rows, BOT_CAR), np.full(rows, BOT_CAR)
    kinds[..., :num_objects], paints[..., :num_objects] = objects.kinds[:, None], objects.paints[:, None]
    return Nearby(np.zeros((*rows, 6)), kinds, paints, np.zeros(rows, OBJECT_STATE), counts, bodies, body_states)


def no_objects() -> ObjectPlan:
    """Return the plan of a race on an empty road."""
    return ObjectPlan(
        np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0), np.zeros(0),
        0.0, False, False, False, False, 0.0, False, 0.0, 0.0, 1.0,
        np.zeros(0), np.zeros((2, 0, 2, 4)), 0.0,
    )  # fmt: skip


def new_objects(plan: ObjectPlan, num_worlds: int) -> Objects:
    """Return the arrays of N worlds whose objects are about to be placed."""
    count = len(plan.kinds)
    boxes = np.zeros((num_worlds, count, 6))
    boxes[..., 3:] = plan.sizes
    kinds = np.tile(plan.kinds, (num_worlds, 1))
    states = np.zeros((num_worlds, count), OBJECT_STATE)
    return Objects(boxes, kinds, kinds, states, np.zeros((num_worlds, 2), np.uint64))


def lane_beside(track: Track, inner: bool) -> float:
    """Return how far left of the centre line a lane of a track lies, share of the half road."""
    return LANE if inner == track.is_ccw else -LANE


def read_positions(text: str) -> list[tuple[float, bool]]:
    """Return listed places as (share of the lap, whether in the inner lane).

    The spelling is DeepRacer for Cloud's: `0.23,-1;0.46,1`; lane -1 is the outer one, anything else the inner.

    Raises:
        SettingError: It is spelt otherwise, or a place lies off the track.

    >>> read_positions("0.23,-1;0.46,1")
    [(0.23, False), (0.46, True)]
    """
    expected = 'expected "share,lane;share,lane" with shares of the lap from 0 to 1 and lane -1 (outer) or 1 (inner)'
    places = []
    for part in filter(None, (part.strip() for part in text.split(";"))):
        try:
            share, lane = (float(word) for word in part.split(","))
        except ValueError:
            raise SettingError("'{part}' is no place on the track; {expected}.", part=part, expected=expected) from None
        if not 0.0 <= share <= 1.0:
            raise SettingError("'{part}' lies off the track; {expected}.", part=part, expected=expected)
        if not math.isfinite(lane):
            raise SettingError("'{part}' names no lane; {expected}.", part=part, expected=expected)
        places.append((share, lane != -1.0))
    return places
