"""Where a world's objects go when an episode begins, in compiled scalar code. Begin at `place_objects`.

A draw is a function of the world's stream, the episode of its first car and the object's number.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import kernel
from racecraft.kernels.rng import uniform_at
from racecraft.worlds.deepracer.env.kernels.bots import line_up_bot
from racecraft.worlds.deepracer.env.kernels.objects import car_touches, note_place
from racecraft.worlds.deepracer.env.objects import CLEAR_AHEAD_M, CLEAR_BEHIND_M, FIXED_END_M
from racecraft.worlds.deepracer.tracks.kernels.geometry import central_yaw_on_line, locate_point, pose_on_line

DRAWS_A_BOX = 3
"""What a box takes of its world's stream of chance each time it is placed: order, place, lane."""
PLACING_TRIES = 8
"""Random places that would fall on another car of the world are drawn anew so often."""
OTHER_CAR_MARGIN_M = 0.5
"""Room that random places leave round cars under way."""


@kernel
def place_objects(track, plan, objects, cars, n, on_the_way):
    """Place world n's objects for the episode that its first car begins; that car's start is where it stands.

    Whatever cars the world has besides stand behind it, and room is kept for them; or the first `on_the_way` of all are
    under way, and random places are drawn anew until none falls on one of them.
    """
    count = plan.kinds.shape[0]
    if count == 0:
        return
    for attempt in range(PLACING_TRIES):
        first_draw = (cars[n, 0].episode * PLACING_TRIES + attempt) * DRAWS_A_BOX * count
        choose_places(track, plan, objects.states[n], objects.keys[n, 0], first_draw, cars, n)
        is_clear = True
        for k in range(count):
            if plan.speed > 0.0:
                line_up_bot(track, plan, objects.boxes[n, k], objects.states[n, k], objects.keys[n, 1], k)
            else:
                put_in_place(track, objects.boxes[n, k], objects.states[n, k])
            for m in range(1, on_the_way):
                if car_touches(cars[n, m].x, cars[n, m].y, cars[n, m].yaw, OTHER_CAR_MARGIN_M, objects.boxes[n, k]):
                    is_clear = False
        if is_clear or not plan.is_random:
            return


@kernel
def choose_places(track, plan, states, key, first_draw, cars, n):
    """Choose arc and lane of every object."""
    count = states.shape[0]
    for k in range(count):
        states[k].arc, states[k].lane = plan.arcs[k], plan.lanes[k]
    if plan.slips:
        space_evenly(track, states, slipped_distance(track, plan, cars[n, 0].episode))
    if not plan.is_random:
        return
    for k in range(count):
        aside = uniform_at(key, np.uint64(first_draw + 2 * count + k))
        states[k].lane = abs(plan.lanes[k]) * (1.0 if aside < 0.5 else -1.0)
    if plan.slips:
        jostle(track, plan, states, key, first_draw, slipped_distance(track, plan, cars[n, 0].episode))
    else:
        spread(track, plan, states, key, first_draw, cars[n, 0].start_share, cars.shape[1])


@kernel
def spread(track, plan, states, key, first_draw, start_share, num_cars):
    """Draw places evenly among all that keep the least distance and the start clear.

    K points drawn on what is left of the lap when all distances to be kept are taken out, sorted, and the distances put
    in again between them: every legal arrangement is as likely as another, and none is drawn in vain.
    """
    count = states.shape[0]
    kept = CLEAR_AHEAD_M + CLEAR_BEHIND_M * num_cars + (count - 1) * plan.least_distance
    free = track.length - kept
    for k in range(count):
        drawn = free * uniform_at(key, np.uint64(first_draw + k))
        slot = k
        while slot > 0 and states[slot - 1].arc > drawn:
            states[slot].arc = states[slot - 1].arc
            slot -= 1
        states[slot].arc = drawn
    for k in range(count):
        past_start = CLEAR_AHEAD_M + states[k].arc + k * plan.least_distance
        states[k].arc = (start_share * track.length + past_start) % track.length


@kernel
def slipped_distance(track, plan, episode):
    """Return the least distance between boxes in an episode, m, as it slips in the original (facts 11, point 8).

    It is taken per cent of the lap, and of that again at each placing: one when the world is made, one before each
    episode, the first (0) included. On laps above 100 m it grows, here up to FIXED_END_M before the end.
    """
    least = plan.least_distance
    for _ in range(min(episode + 2, 64)):
        least *= 0.01 * track.length
    return min(least, track.length - FIXED_END_M)


@kernel
def space_evenly(track, states, least):
    """Put boxes at even distances from `least`, m past the start line, to FIXED_END_M before the end of the lap."""
    count = states.shape[0]
    for k in range(count):
        share = k / (count - 1) if count > 1 else 0.0
        states[k].arc = least + share * (track.length - FIXED_END_M - least)


@kernel
def jostle(track, plan, states, key, first_draw, least):
    """Draw places as the original does: one after the other, in shuffled order, between its neighbours' distances."""
    count = states.shape[0]
    order = np.arange(count)
    for k in range(count - 1, 0, -1):
        other = int(uniform_at(key, np.uint64(first_draw + k)) * (k + 1))
        order[k], order[other] = order[other], order[k]
    for k in order:
        low = (states[k - 1].arc if k > 0 else 0.0) + least
        high = (states[k + 1].arc if k < count - 1 else track.length) - least
        if low < high:
            states[k].arc = low + (high - low) * uniform_at(key, np.uint64(first_draw + count + k))


@kernel
def put_in_place(track, box, state):
    """Stand an object in its lane at its arc, along the road."""
    box[0], box[1] = beside_line(track, state.arc, state.lane)
    box[2] = central_yaw_on_line(track.centre, track.arc, track.closed, state.arc)
    note_place(track, box, state)


@kernel
def beside_line(track, arc, left):
    """Return the point beside the centre line by a share of the half road, left positive."""
    x, y, _ = pose_on_line(track.centre, track.arc, track.closed, arc)
    _, _, _, _, ix, iy, ox, oy = locate_point(track, x, y)
    inner = (left > 0.0) == track.is_ccw
    bx, by = (ix, iy) if inner else (ox, oy)
    return x + abs(left) * (bx - x), y + abs(left) * (by - y)
