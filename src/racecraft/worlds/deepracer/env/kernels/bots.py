"""Bots on their rails, in compiled scalar code. Begin at `drive_bots`.

A bot's place is how far it has driven along the centre line; where that is in its lane a spline says (`lanes.py`).
While it changes lanes it is between the two splines, by a smooth share of the way (facts 6.2).
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel
from racecraft.kernels.rng import uniform_at
from racecraft.worlds.deepracer.env.kernels.objects import note_place
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.kernels.geometry import row_after


@kernel
def drive_bots(track, plan, objects, reports, n):
    """Let world n's bots drive for a tick; where one of them ran into a car, all stand for the penalty."""
    if plan.speed == 0.0:
        return
    pauses = False
    for m in range(reports.shape[1]):
        report = reports[n, m]
        hit_bot = 0 <= report.object_hit < plan.kinds.shape[0]
        pauses = pauses or (hit_bot and not report.is_crashed)
    for k in range(plan.kinds.shape[0]):
        state = objects.states[n, k]
        if pauses and state.pause <= 0.0:
            state.pause = plan.penalty
        if state.pause > 0.0:
            state.pause -= TICK_SECONDS
        else:
            drive_bot(track, plan, state, objects.keys[n, 1], k)
            take_pose(track, plan, objects.boxes[n, k], state)


@kernel
def drive_bot(track, plan, state, key, k):
    """Move a bot along by a tick, and its change of lanes with it."""
    step = plan.speed * TICK_SECONDS
    state.driven = (state.driven + step) % track.length
    if not plan.changes_lanes:
        return
    if state.change_driven >= 0.0:
        state.change_driven += step
        if state.change_driven >= plan.change_distance:
            state.lane, state.change_driven = state.next_lane, -1.0
            state.change_in = time_to_change(plan, state, key, k)
    else:
        state.change_in -= TICK_SECONDS
        if state.change_in <= 0.0:
            state.next_lane, state.change_driven = -state.lane, 0.0


@kernel
def time_to_change(plan, state, key, k):
    """Draw for how many seconds a bot keeps its lane."""
    low, high = plan.change_after_low, plan.change_after_high
    count = plan.kinds.shape[0]
    draw = uniform_at(key, np.uint64(state.changes * count + k))
    state.changes += 1
    return low + (high - low) * draw


@kernel
def line_up_bot(track, plan, box, state, key, k):
    """Put a bot where it begins an episode: at `state.arc`, in `state.lane`, about to drive."""
    state.driven = state.arc
    state.next_lane, state.change_driven, state.pause = state.lane, -1.0, 0.0
    state.change_in = time_to_change(plan, state, key, k) if plan.changes_lanes else 0.0
    take_pose(track, plan, box, state)


@kernel
def take_pose(track, plan, box, state):
    """Write where a bot now is."""
    x, y, dx, dy = on_spline(plan, state.lane, state.driven)
    if state.change_driven >= 0.0:
        share = min(state.change_driven / plan.change_distance, 1.0)
        other_x, other_y, other_dx, other_dy = on_spline(plan, state.next_lane, state.driven)
        over = share * share * (3.0 - 2.0 * share)
        slope = 6.0 * share * (1.0 - share) / plan.change_distance
        dx += over * (other_dx - dx) + slope * (other_x - x)
        dy += over * (other_dy - dy) + slope * (other_y - y)
        x += over * (other_x - x)
        y += over * (other_y - y)
    box[0], box[1], box[2] = x, y, math.atan2(dy, dx)
    note_place(track, box, state)


@kernel
def on_spline(plan, lane, driven):
    """Return x, y and their change per metre of centre line, on a lane's spline."""
    side = 1 if lane > 0.0 else 0
    knots, cubics = plan.knots, plan.cubics
    piece = min(max(row_after(knots, driven) - 1, 0), cubics.shape[1] - 1)
    t = driven - knots[piece]
    a, b = cubics[side, piece, 0], cubics[side, piece, 1]
    x = a[0] + t * (a[1] + t * (a[2] + t * a[3]))
    y = b[0] + t * (b[1] + t * (b[2] + t * b[3]))
    return x, y, a[1] + t * (2.0 * a[2] + 3.0 * t * a[3]), b[1] + t * (2.0 * b[2] + 3.0 * t * b[3])
