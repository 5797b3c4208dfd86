"""A car drives on by itself, tick after tick, the network's likeliest choice every time. Begin with `drive_on`."""

from racecraft.algorithms.kernels.greedy_action import argmax_action
from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.kernels.race import tick_world
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE


@kernel
def drive_on(
    n, ticks, layers, weights, scale, rooms, menu_numbers, menu_chosen, menu_sent,
    track, plan, objects, around, profiles, rules, scene, optics, eyes, lidar, palettes, numbers, chosen, sent, parked,
    keys, cars, reports, ranges, frames, critic_views, lidar_views, last_frames, last_critic_views, last_lidar_views,
):  # fmt: skip
    """Let the only car of world `n` drive until there is something to tell: a full lap, or the end of its episode.

    Returns whether there is; False after so many `ticks` without. `layers`, `weights` and `scale` are those of a
    `CompiledPolicy`, `rooms` float32 (N, 3, W), one for each to look in; `menu_numbers` (A, 1), `menu_chosen` and
    `menu_sent` (A, 1, 2) what each choice tells a car. The others are those of `tick`.

    It takes one thread, and a car sees no other world: so several may drive at once, and none waits for another.
    """
    for _ in range(ticks):
        choice = argmax_action(layers, weights, scale, frames[n, 0, 0], rooms[n])
        numbers[n, 0] = menu_numbers[choice, 0]
        chosen[n, 0, 0], chosen[n, 0, 1] = menu_chosen[choice, 0, 0], menu_chosen[choice, 0, 1]
        sent[n, 0, 0], sent[n, 0, 1] = menu_sent[choice, 0, 0], menu_sent[choice, 0, 1]
        tick_world(
            track, plan, objects, around, profiles, rules, scene, optics, eyes, lidar, palettes, numbers, chosen, sent,
            parked, keys, cars, reports, ranges, frames, critic_views, lidar_views, last_frames, last_critic_views,
            last_lidar_views, n,
        )  # fmt: skip
        report = reports[n, 0]
        if report.terminated or report.truncated or report.status == LAP_COMPLETE:
            return True
    return False
