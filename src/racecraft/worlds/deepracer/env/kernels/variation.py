"""What disturbs a finished frame and a command on its way, in compiled scalar code.

Begin at `disturb_frames` and `send_late`. Every draw is a function of a car's own stream and of its tick, so the bits
depend neither on threads nor on company.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.kernels.rng import normal_at, random_bits, uniform_at

EVERY_OTHER_BYTE, ONE_IN_EVERY_PAIR = np.uint64(0x00FF00FF00FF00FF), np.uint64(0x0001000100010001)
BLACK, WHITE = np.float32(0.0), np.float32(255.0)
BYTES_MEAN, BYTES_SPREAD = 8 * 127.5, math.sqrt(8 * (256.0**2 - 1.0) / 12.0)
"""Of the sum of the eight bytes of one draw, which is spread nearly as a normal number is, and never beyond 4.9."""
BLUR_REACH = 3.0
"""A lens spreads a point over so many of its standard deviations to either side."""
SENT_DRAWS = 4
"""What a car takes of its stream of noisy commands in a tick."""


@parallel_kernel
def draw_evenly(keys, rows, episodes, draws):
    """Write the draws (N, M, D), evenly from 0 to 1, of the episode that each car of `rows` (N, M) begins."""
    for n in prange(keys.shape[0]):
        for m in range(keys.shape[1]):
            if rows[n, m]:
                for place in range(draws.shape[2]):
                    draws[n, m, place] = uniform_at(keys[n, m], np.uint64(episodes[n, m] * draws.shape[2] + place))


@parallel_kernel
def send_late(drawn, latency, keys, cars, waiting, chosen, sent):
    """Write what reaches the cars this tick of what was sent to them: later, crooked, and not quite what was told.

    Args:
        drawn: DRAWN_DTYPE (N, M), what the cars' episodes have drawn.
        latency: int64 (N, M), ticks that commands are under way.
        keys: uint64 (N, M), each car's stream of noisy commands.
        cars: CAR_STATE (N, M), before the tick.
        waiting: float64 (N, M, L, 2), commands under way, a ring by tick of the episode; written.
        chosen: float64 (N, M, 2), steering in rad and speed in m/s as sent.
        sent: float64 (N, M, 2), written. Before the first command arrives the car stands, wheels straight.
    """
    length = waiting.shape[2]
    for n in prange(cars.shape[0]):
        for m in range(cars.shape[1]):
            tick, one = cars[n, m].ticks, drawn[n, m]
            waiting[n, m, tick % length] = chosen[n, m]
            sent_tick = tick - latency[n, m]
            steering, speed = 0.0, 0.0
            if (
                sent_tick >= 1 or latency[n, m] == 0
            ):  # that of the first tick, in which the car is held, is never obeyed
                steering, speed = waiting[n, m, sent_tick % length, 0], waiting[n, m, sent_tick % length, 1]
            steering = steering * one.steering_gain + one.steering_offset
            counter = np.uint64(SENT_DRAWS * cars[n, m].total_ticks)
            if one.steering_noise > 0.0:
                steering += one.steering_noise * normal_at(keys[n, m], counter)
            if one.speed_noise > 0.0:
                speed *= max(0.0, 1.0 + one.speed_noise * normal_at(keys[n, m], counter + np.uint64(2)))
            sent[n, m, 0], sent[n, m, 1] = steering, speed


@parallel_kernel
def disturb_frames(
    optics, drawn, glare_width, noise_keys, drop_keys, cars, rows, is_last, shown, frames
):  # fmt: skip
    """Turn what cameras should have seen into what they show.

    Light over the frame, a glow, an unsharp lens, then noise; and now and then the frame before.

    Args:
        optics: OPTICS (N, M).
        drawn: DRAWN_DTYPE (N, M), what the cars' episodes have drawn.
        glare_width: Spread of a glow, rad.
        noise_keys: uint64 (N, M), each car's stream of noise in its frames.
        drop_keys: uint64 (N, M), each car's stream of frames that fail.
        cars: CAR_STATE (N, M), after the tick.
        rows: bool (N, M), which cars' frames are meant.
        is_last: Whether these are the last frames of episodes, which the next does not repeat.
        shown: uint8 (N, M, E, H, W), the frames shown before; written unless `is_last`.
        frames: uint8 (N, M, E, H, W), changed in place.
    """
    for n in prange(cars.shape[0]):
        for m in range(cars.shape[1]):
            if rows[n, m]:
                car, one = cars[n, m], drawn[n, m]
                yaw = car.ended_yaw if is_last else car.yaw
                moment = np.uint64(2 * car.total_ticks + is_last)
                dropped = is_last or car.ticks > 0  # there is a frame before
                dropped = dropped and uniform_at(drop_keys[n, m], moment) < one.dropped_frames
                for eye in range(frames.shape[2]):
                    frame = frames[n, m, eye]
                    if dropped:
                        frame[:] = shown[n, m, eye]
                        continue
                    first = (moment * np.uint64(frames.shape[2]) + np.uint64(eye)) * np.uint64(frame.size)
                    disturb_frame(frame, optics[n, m], yaw, one, glare_width, noise_keys[n, m], first)
                    if not is_last:
                        shown[n, m, eye] = frame


@kernel
def disturb_frame(frame, optics, yaw, one, glare_width, key, first):
    """Light, glow, lens and noise over one frame (H, W); nothing where the record has none of them."""
    gain, gradient_x, gradient_y, noise = one.gain, one.gradient_x, one.gradient_y, one.noise
    is_lit = gain != 1.0 or gradient_x != 0.0 or gradient_y != 0.0
    if not (is_lit or one.glare > 0.0 or one.blur > 0.0 or noise > 0.0):
        return
    height, width = frame.shape
    across = np.empty(width, np.float32)
    for column in range(width):
        across[column] = gain * gradient_x * (2.0 * (column + 0.5) / width - 1.0)
    levels = np.empty((height, width), np.float32)
    for row in range(height):
        here = np.float32(gain * (1.0 + gradient_y * (2.0 * (row + 0.5) / height - 1.0)))
        for column in range(width):
            levels[row, column] = np.float32(frame[row, column]) * (here + across[column])
    if one.glare > 0.0:
        add_glow(levels, optics, one.glare_azimuth - yaw, one.glare_elevation, one.glare, glare_width)
    if one.blur > 0.0:
        blur(levels, one.blur * width)
    if noise > 0.0:
        for row in range(height):
            for column in range(width):
                levels[row, column] += noise * stray(random_bits(key, first + np.uint64(row * width + column)))
    for row in range(height):
        for column in range(width):
            frame[row, column] = np.uint8(min(max(levels[row, column] + np.float32(0.5), BLACK), WHITE))


@kernel
def stray(bits):
    """Return a number spread nearly as a standard normal one, of one draw: its eight bytes, summed up."""
    pairs = (bits & EVERY_OTHER_BYTE) + ((bits >> np.uint64(8)) & EVERY_OTHER_BYTE)
    total = (pairs * ONE_IN_EVERY_PAIR) >> np.uint64(48)
    return (np.float64(total) - BYTES_MEAN) / BYTES_SPREAD


@kernel
def add_glow(levels, optics, bearing, elevation, strength, spread):
    """Add a glow that stands so far left of the car's nose and so far above the horizon, rad, as far as it is ahead."""
    ahead, left, up = (
        math.cos(elevation) * math.cos(bearing), math.cos(elevation) * math.sin(bearing), math.sin(elevation)
    )  # fmt: skip
    depth = ahead * optics.cos_pitch - up * optics.sin_pitch
    down = -ahead * optics.sin_pitch - up * optics.cos_pitch
    if depth <= 0.1:
        return
    left, down = optics.cos_roll * left - optics.sin_roll * down, optics.cos_roll * down + optics.sin_roll * left
    middle_x = optics.middle_x - optics.focal * left / depth
    middle_y = optics.middle_y + optics.focal * down / depth
    height, width = levels.shape
    reach = optics.focal * spread
    across = np.empty(width)
    for column in range(width):
        across[column] = math.exp(-0.5 * ((column + 0.5 - middle_x) / reach) ** 2)
    for row in range(height):
        glow = strength * math.exp(-0.5 * ((row + 0.5 - middle_y) / reach) ** 2)
        for column in range(width):
            levels[row, column] += glow * across[column]


@kernel
def blur(levels, spread):
    """Spread every pixel (H, W) as an unsharp lens does, Gaussian, `spread` in px; an edge goes on beyond the frame.

    A row is summed up tap by tap, so that many pixels are worked on at a time.
    """
    height, width = levels.shape
    reach = int(math.ceil(BLUR_REACH * spread))
    taps = 2 * reach + 1
    bell = np.empty(taps)
    for tap in range(taps):
        bell[tap] = math.exp(-0.5 * ((tap - reach) / spread) ** 2)
    weights = (bell / bell.sum()).astype(np.float32)
    aside = np.zeros((height, width), np.float32)
    wider = np.empty(width + 2 * reach, np.float32)
    for row in range(height):
        wider[:reach], wider[reach + width :] = levels[row, 0], levels[row, width - 1]
        wider[reach : reach + width] = levels[row]
        for tap in range(taps):
            weight = weights[tap]
            for column in range(width):
                aside[row, column] += weight * wider[tap + column]
    for row in range(height):
        levels[row] = np.float32(0.0)
        for tap in range(taps):
            weight, other = weights[tap], min(max(row + tap - reach, 0), height - 1)
            for column in range(width):
                levels[row, column] += weight * aside[other, column]
