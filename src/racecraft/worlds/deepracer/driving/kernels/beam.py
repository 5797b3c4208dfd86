"""Beam search for a fast lap, in compiled code; what it does and why is told in `planner.py`. Begin with `search`."""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, lean_kernel, parallel_kernel, prange
from racecraft.worlds.deepracer.driving.kernels.road_raster import has_wheel_on_road
from racecraft.worlds.deepracer.env.kernels.vehicle import SUBSTEP_SECONDS, controls_after, drive
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS

MAX_OFFSET_M = 1.5
"""A car farther from the line is given up: on wide tracks the start on the centre line is that far away."""
SAME_OFFSET_M, SAME_ANGLE, SAME_SPEED, SAME_STATION_M = 0.02, 0.04, 0.15, 0.06
"""States whose offset, heading and wheel angle (rad), speed (m/s) and place on the line agree so far are one."""
COARSE_SECONDS = TICK_SECONDS / 3
"""Substep with which children are rated; those that live on are driven again as the world drives them."""
OFF = -math.inf
"""Score of a child that is off the road or far from the guide, and how far a car came that is off the road."""
STATE_SIZE = 7
"""x, y (m), yaw (rad), speed (m/s), wheel angle (rad), last commanded angle (rad) and speed (m/s)."""


@parallel_kernel
def search(  # noqa: D417
    track, x0, y0, cells, car, line, spacing, lap_seconds, closed, commands, weights, start, goal, beam, ticks
):  # fmt: skip
    """Return (ticks driven, row of the winner, parents, choices); the row is -1 where no state reached the goal.

    Args:
        track: TrackArrays.
        x0, y0, cells: The road's raster, see `fill_raster`.
        car: CarProfile.
        line: (G, 7) the guide: x, y, cos and sin of its heading, speed, seconds since its first point, heading.
        spacing: m between its points.
        lap_seconds: s once around it.
        closed: Whether its last point is followed by its first.
        commands: (A, 2) what the car may be told: angle (rad, positive left) and speed (m/s).
        weights: Price in s of a squared offset (s/m²), heading error (s/rad²), speed above the guide's (s³/m²).
        start: (STATE_SIZE,) where the car stands.
        goal: m along the guide at which the search ends.
        beam: How many states live on after each tick.
        ticks: Largest number of ticks.
    """
    count = commands.shape[0]
    states, places, reached = np.zeros((beam, STATE_SIZE)), np.zeros(beam, np.int64), np.zeros(beam)
    parents, choices = np.zeros((ticks, beam), np.int32), np.zeros((ticks, beam), np.int32)
    scores, keys = np.empty(beam * count), np.empty(beam * count, np.int64)
    answers = np.empty(beam * count, np.int64)
    states[0] = start
    places[0] = _nearest_place(line, start[0], start[1])
    alive = 1
    for tick in range(ticks):
        for each in prange(alive):
            i = np.int64(each)
            _rate_children(
                track, x0, y0, cells, car, line, spacing, lap_seconds, closed, commands, weights, states[i], places[i],
                reached[i], i * count, answers, scores, keys,
            )  # fmt: skip
        before, places_before = states.copy(), places.copy()
        alive = _select(scores, keys, alive * count, count, beam, parents[tick], choices[tick])
        if alive == 0:
            return tick + 1, -1, parents, choices
        for each in prange(alive):
            i = np.int64(each)
            parent = parents[tick, i]
            places[i], reached[i] = _drive_on(
                track, x0, y0, cells, car, line, spacing, closed, before[parent], places_before[parent],
                commands[choices[tick, i]], states[i],
            )  # fmt: skip
        winner = np.argmax(reached[:alive])
        if reached[winner] >= goal:
            return tick + 1, winner, parents, choices
    return ticks, -1, parents, choices


@lean_kernel
def _rate_children(
    track, x0, y0, cells, car, line, spacing, lap_seconds, closed, commands, weights, state, place, reached, first,
    answers, scores, keys,
):  # fmt: skip
    """Write score and key of each child of a state, from row `first` on."""
    for a in range(commands.shape[0]):
        child = first + a
        scores[child] = OFF
        answers[child] = _answer(car, state, commands[a])
        if reached == OFF or _is_told_before(answers, first, child):
            continue
        x, y, yaw, speed, steering, there, share, offset = _driven(
            car, line, spacing, closed, state, place, commands[a], COARSE_SECONDS
        )
        if abs(offset) > MAX_OFFSET_M or not has_wheel_on_road(track, x0, y0, cells, x, y, yaw):
            continue
        row = there % line.shape[0]
        ahead = yaw - line[row, 6]
        ahead -= 2 * math.pi * round(ahead / (2 * math.pi))
        excess = max(0.0, speed - line[row, 4])
        scores[child] = (
            _seconds_at(line, lap_seconds, there, share)
            - weights[0] * offset * offset - weights[1] * ahead * ahead - weights[2] * excess * excess
        )  # fmt: skip
        keys[child] = _key(offset, ahead, steering, speed, (there + share) * spacing)


@lean_kernel
def _answer(car, state, command):
    """Return a number that commands share which a car answers alike: twice as nearly so as states that are one."""
    speed, steering = controls_after(
        car, state[3], state[4], state[5], state[6], command[0], command[1], TICK_SECONDS, COARSE_SECONDS
    )
    return np.int64(round(2.0 * steering / SAME_ANGLE)) * 65536 + np.int64(round(2.0 * speed / SAME_SPEED))


@lean_kernel
def _is_told_before(answers, first, child):
    """Tell whether answers[child] stands among those from `first` on before it."""
    k = first
    while answers[k] != answers[child]:
        k += 1
    return k < child


@lean_kernel
def _drive_on(track, x0, y0, cells, car, line, spacing, closed, before, place, command, state):
    """Write a state a tick later as the world drives it; return its place and how far it came, m; OFF off the road."""
    x, y, yaw, speed, steering, place, share, _ = _driven(
        car, line, spacing, closed, before, place, command, SUBSTEP_SECONDS
    )
    state[0], state[1], state[2], state[3], state[4] = x, y, yaw, speed, steering
    state[5], state[6] = command[0], command[1]
    return place, (place + share) * spacing if has_wheel_on_road(track, x0, y0, cells, x, y, yaw) else OFF


@lean_kernel
def _driven(car, line, spacing, closed, state, place, command, substep_seconds):
    """Drive one tick; return x, y, yaw, speed, wheel angle and where on the guide that is, see `_locate`."""
    x, y, yaw, speed, steering = drive(
        car, state[0], state[1], state[2], state[3], state[4], state[5], state[6], command[0], command[1],
        TICK_SECONDS, substep_seconds,
    )  # fmt: skip
    place, share, offset = _locate(line, spacing, closed, place, x, y)
    return x, y, yaw, speed, steering, place, share, offset


@kernel
def _select(scores, keys, candidates, count, beam, parents, choices):
    """Keep the best `beam` children of which no two are nearly equal; return how many there are."""
    slots = np.full(2 * scores.shape[0], -1)  # the best child of each key, by open addressing
    for child in range(candidates):
        if scores[child] == OFF:
            continue
        slot = keys[child] % slots.shape[0]
        while slots[slot] >= 0 and keys[slots[slot]] != keys[child]:
            slot = (slot + 1) % slots.shape[0]
        if slots[slot] < 0 or scores[child] > scores[slots[slot]]:
            slots[slot] = child
    unlike = slots[slots >= 0]
    order = unlike[np.argsort(-scores[unlike])][:beam]
    for k in range(order.shape[0]):
        parents[k], choices[k] = order[k] // count, order[k] % count
    return order.shape[0]


@lean_kernel
def _key(offset, ahead, steering, speed, done):
    """Return a positive number that nearly equal states share."""
    key = np.int64(round(offset / SAME_OFFSET_M)) + 512
    key = key * 512 + np.int64(round(ahead / SAME_ANGLE)) + 256
    key = key * 128 + np.int64(round(steering / SAME_ANGLE)) + 64
    key = key * 128 + np.int64(round(speed / SAME_SPEED))
    return key * 65536 + np.int64(round(done / SAME_STATION_M)) % 65536


@kernel
def _nearest_place(line, x, y):
    best, place = math.inf, 0
    for i in range(line.shape[0]):
        gap = (line[i, 0] - x) ** 2 + (line[i, 1] - y) ** 2
        if gap < best:
            best, place = gap, i
    # Just behind the first point of a loop is before the lap's start, not at its end.
    return place - line.shape[0] if place > line.shape[0] // 2 else place


@lean_kernel
def _locate(line, spacing, closed, place, x, y):
    """Return where on the guide a car is, walking from where it was: point, share of the step behind it, offset (m)."""
    for _ in range(24):
        row = place % line.shape[0]
        dx, dy = x - line[row, 0], y - line[row, 1]
        along = line[row, 2] * dx + line[row, 3] * dy
        if along > spacing and (closed or row < line.shape[0] - 1):
            place += 1
        elif along < 0.0 and (closed or row > 0):
            place -= 1
        else:
            break
    share = min(max(along / spacing, 0.0), 1.0)
    return place, share, line[row, 2] * dy - line[row, 3] * dx


@lean_kernel
def _seconds_at(line, lap_seconds, place, share):
    points = line.shape[0]
    laps, row = place // points, place % points
    here = line[row, 5]
    after = line[row + 1, 5] if row + 1 < points else lap_seconds
    return laps * lap_seconds + here + share * (after - here)
