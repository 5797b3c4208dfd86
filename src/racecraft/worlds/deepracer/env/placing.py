"""From what a race asks for to where its boxes or bots go. Begin with `plan_objects`.

Places are fixed (spread evenly, lane by lane), listed, or drawn for every episode; `kernels/placing.py` puts them down.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.fidelity import AwsQuirks
from racecraft.worlds.deepracer.env.kernels.objects import rectangles_touch
from racecraft.worlds.deepracer.env.kernels.placing import put_in_place
from racecraft.worlds.deepracer.env.lanes import lane_splines
from racecraft.worlds.deepracer.env.objects import (
    BOT_CAR,
    BOX_TYPES,
    CLEAR_AHEAD_M,
    CLEAR_BEHIND_M,
    FIXED_END_M,
    KINDS,
    ObjectPlan,
    lane_beside,
    new_objects,
    no_objects,
    read_positions,
)
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig
from racecraft.worlds.deepracer.tracks.track import Track


def plan_objects(
    track: Track, boxes: BoxesConfig | BotsConfig | None, habits: AwsQuirks, num_cars: int = 1
) -> ObjectPlan:
    """Return what a race asks for on a track.

    Args:
        track: The circuit, in driving direction.
        boxes: Boxes, bots, or nothing at all.
        habits: Which of the original's bugs the world has.
        num_cars: Cars of a world; random places leave room for their starts.

    Raises:
        SettingError: So many do not fit, two listed places overlap, or times are the wrong way round.
    """
    # Other cars are touched, and blamed, by the same habits as objects.
    empty = no_objects()._replace(corners_only=habits.corners_collide, blames_by_lap=habits.blame_is_by_lap)
    if boxes is None:
        return empty
    positions = boxes.positions if isinstance(boxes, BoxesConfig) else ""
    places = read_positions(positions)
    count = len(places) or boxes.number
    if places:
        arcs = np.array([share * track.length for share, _ in places])
        inner = [is_inner for _, is_inner in places]
    else:
        arcs = np.linspace(boxes.min_distance, track.length - FIXED_END_M, count)
        inner = [k % 2 == 0 for k in range(count)]
    moves = isinstance(boxes, BotsConfig)
    kind = BOX_TYPES.index(boxes.type) if isinstance(boxes, BoxesConfig) and not boxes.as_cars else BOT_CAR
    built = KINDS[kind]
    plan = empty._replace(
        sizes=np.tile([built.length / 2, built.width / 2, built.height], (count, 1)),
        kinds=np.full(count, kind, np.int64),
        arcs=arcs,
        lanes=np.array([lane_beside(track, is_inner) for is_inner in inner]),
        is_random=boxes.random and not places,
        slips=habits.box_distance_slips and not moves and not places,
        least_distance=boxes.min_distance,
    )
    if isinstance(boxes, BotsConfig):
        if boxes.lane_change_after_low > boxes.lane_change_after_high:
            raise SettingError(
                "bots.lane_change_after_low is {lane_change_after_low:g} s, bots.lane_change_after_high "
                "{lane_change_after_high:g} s; expected the least time to be no longer than the most.",
                lane_change_after_low=boxes.lane_change_after_low,
                lane_change_after_high=boxes.lane_change_after_high,
            )
        knots, cubics = lane_splines(track)
        plan = plan._replace(
            knots=knots,
            cubics=cubics,
            speed=boxes.speed,
            changes_lanes=boxes.lane_change,
            change_after_low=boxes.lane_change_after_low,
            change_after_high=boxes.lane_change_after_high,
            change_distance=boxes.lane_change_distance,
            penalty=boxes.penalty,
        )
    if places:
        _require_apart(track, plan, positions)
    else:
        _require_space(track, plan, num_cars, "bots" if moves else "boxes")
    return plan


def _require_space(track: Track, plan: ObjectPlan, num_cars: int, group: str) -> None:
    """Refuse more objects than fit on the lap with their least distance, or their own length, between them."""
    count = len(plan.kinds)
    if count == 0 or (plan.is_random and plan.slips):
        return
    least = 0.0 if plan.slips else plan.least_distance
    spacing = max(least, 2.0 * float(plan.sizes[0, 0]))
    kept = CLEAR_AHEAD_M + CLEAR_BEHIND_M * num_cars if plan.is_random else FIXED_END_M + least
    fitting = 1 + math.floor((track.length - kept) / spacing + 1e-9) if track.length >= kept else 0
    if count > fitting:
        raise SettingError(
            "{group}.number is {count}, {group}.min_distance {least_distance:g} m: so many do not fit on "
            "{name}, which is {length:.1f} m long, of which {kept:.2f} m stay clear; expected at most "
            "{fitting}. Ask for fewer, or for less distance.",
            group=group,
            count=count,
            least_distance=plan.least_distance,
            name=track.name,
            length=track.length,
            kept=kept,
            fitting=fitting,
        )


def _require_apart(track: Track, plan: ObjectPlan, positions: str) -> None:
    """Refuse listed places of which two overlap."""
    objects = new_objects(plan, 1)
    arrays = track.arrays()
    parts = [part.strip() for part in positions.split(";") if part.strip()]
    for k in range(len(plan.kinds)):
        objects.states[0, k]["arc"], objects.states[0, k]["lane"] = plan.arcs[k], plan.lanes[k]
        put_in_place(arrays, objects.boxes[0, k], objects.states[0, k])
        for other in range(k):
            if rectangles_touch(*objects.boxes[0, k, :5], *objects.boxes[0, other, :5]):
                raise SettingError(
                    "boxes.positions: '{parts}' and '{parts_2}' overlap on {name}; expected places "
                    "further apart: a box is {sizes:g} m long.",
                    parts=parts[other],
                    parts_2=parts[k],
                    name=track.name,
                    sizes=2 * plan.sizes[k, 0],
                )
