"""Where the original's habits are bugs: what it did, what we do instead, and the one switch for each.

`RaceConfig.fidelity` is `sane` or `aws`. Every departure is one row of `DEPARTURES` and one field of `AwsQuirks`, which
is asked in exactly one place of the code. Begin with `DEPARTURES`; `as_table` renders it for a page.

What a learner does with what it saw (minibatches left out, probabilities with a floor) is no habit of the world: the
presets own that. Which car is driven is `RaceConfig.car`'s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

FIDELITIES = {
    "sane": "the original's bugs are left out",
    "aws": "the original's habits, bugs included",
}
"""Every fidelity, with what it means."""

AWS_MAX_TICKS = 100_000
"""The original's own limit on an episode, an hour and 51 minutes (facts: simapp `deepracer_racetrack_env.py`)."""
SANE_MAX_SECONDS, SANE_MIN_SPEED = 100.0, 0.4
"""Ours where `RaceConfig.max_episode_seconds` says nothing: s for a lap, and m/s at which one may always be finished.
The slowest action of the default car asks for 0.5 m/s: on 60 m a car that never errs needs more than 100 s."""
TICK_JITTER = 0.085
"""How far the length of the original's steps strays from 1/15 s, share of it. Where a logged car has held its speed for
twelve rows, the way it makes in a row scatters by 8 %; neighbours pull against each other as poses read a little early
or late do, and taking that part out leaves 4.9 %, the spread of lengths that are as likely anywhere within 8.5 %
(`tests/worlds/deepracer/env/test_jitter.py` computes it from the logs of 2022)."""
WHEEL_KICK = math.radians(1.1)
"""Spread of the push, rad, that the angle of the wheels takes in every tick of the original. They come back with the
lag of the car's steering, so those of the car of 2022 wander by 2 degrees about what they are told.

Our own car, blind, strays within a second by 5.2 and 5.6 degrees of heading (medians) from a car that is pushed so,
from the logged cars of 2022 by 5.2 (console) and 5.7 (DeepRacer for Cloud): `tests/worlds/deepracer/env/test_wander.py`
computes it. What a tick's turn has left over when regressed on all that was told before says 0.9 and 1.0 degrees."""


@dataclass(frozen=True)
class AwsQuirks:
    """The switches; every one is True at AWS and False where the world is sane."""

    prepare_is_learned: bool
    episodes_are_endless: bool
    cut_is_an_end: bool
    lap_is_an_end: bool
    memory_is_finite: bool
    evaluation_follows_training: bool
    newest_of_equals: bool
    commands_are_as_written: bool
    ticks_jitter: bool
    wheels_wander: bool
    wheels_keep_their_angle: bool
    lidar_faces_backward: bool
    lidar_is_slow: bool
    lidar_is_noisy: bool
    box_distance_slips: bool
    progress_jumps: bool
    corners_collide: bool
    blame_is_by_lap: bool


class Quirk(NamedTuple):
    """One row of the table."""

    habit: str
    """The field of `AwsQuirks`."""
    original: str
    """What the original does."""
    sane: str
    """What we do instead."""
    asked_in: str
    """Where the code asks."""


DEPARTURES = (
    Quirk(
        "prepare_is_learned",
        "The first tick of an episode, in which the car is held and its command ignored, is learned from like another.",
        "It is kept out of learning.",
        "worlds/deepracer/env/world.py",
    ),
    Quirk(
        "episodes_are_endless",
        f"An episode has no time limit but {AWS_MAX_TICKS} ticks: a slow policy that lives stretches an iteration.",
        f"It is cut after {SANE_MAX_SECONDS:g} s of simulated time a lap, or as long as one takes at "
        f"{SANE_MIN_SPEED:g} m/s, or what race.max_episode_seconds says.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "cut_is_an_end",
        "An episode that is cut counts as ended: nothing is expected to follow.",
        "It counts as truncated: what the critic expects of its last observation follows.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "lap_is_an_end",
        "A complete lap ends a training episode: nothing is expected to follow, as if the car had left the road.",
        "The car drives on, and what the critic expects of it follows; race.max_training_seconds puts it back to a "
        "standing start.",
        "worlds/deepracer/training/trainer.py",
    ),
    Quirk(
        "memory_is_finite",
        "Once an iteration's episodes hold more than 10 000 ticks (3 000 with larger networks), the rest of them is "
        "dropped: exactly the long, successful ones cost the others their place.",
        "Everything that was driven is learned from.",
        "worlds/deepracer/training/presets.py",
    ),
    Quirk(
        "evaluation_follows_training",
        "Every episode of an evaluation starts where training's next episode would.",
        "Starts are spread evenly round the track and are the same in every evaluation.",
        "worlds/deepracer/training/evaluator.py",
    ),
    Quirk(
        "newest_of_equals",
        "Of checkpoints with the same mean progress, reward or lap time the newest is the best.",
        "The one with the fastest lap is; of those that are equal in that, too, the newest.",
        "worlds/deepracer/training/evaluator.py",
    ),
    Quirk(
        "commands_are_as_written",
        "The reward function and the traces see speed and angle as the action table has them, also where the car is "
        "held to 0.1 to 4 m/s and 30 degrees.",
        "They see what the car is sent.",
        "worlds/deepracer/env/world.py",
    ),
    Quirk(
        "ticks_jitter",
        f"A step lasts 1/15 s on average and up to {100 * TICK_JITTER:g} % more or less, so greedy episodes from one "
        "start end in different places.",
        "Every tick lasts 1/15 s: the same policy drives the same lap.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "wheels_wander",
        "Weak hinges let the ground push the wheels about: their angle strays from what the car was told, by 2 degrees "
        "in the car of 2022, and comes back as slowly as it steers.",
        "The wheels have the angle that the commands gave them.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "wheels_keep_their_angle",
        "A car put back to its start keeps the angle of its wheels, which obey the last command for another tick and "
        "are steered straight in the first: an episode begins with a turn that nobody in it chose.",
        "Every episode begins with the wheels straight.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "lidar_faces_backward",
        "The LiDAR is mounted with its nose to the car's tail: its blind 60 degrees lie straight ahead.",
        "Its nose points ahead; the blind 60 degrees lie behind.",
        "worlds/deepracer/env/sensor_rendering.py",
    ),
    Quirk(
        "lidar_is_slow",
        "It reads 10 times a second: every third tick is told of what was read the tick before.",
        "It reads 15 times a second, once for every frame.",
        "worlds/deepracer/env/sensor_rendering.py",
    ),
    Quirk(
        "lidar_is_noisy",
        "Readings stray by 1 cm (standard deviation).",
        "Readings are exact.",
        "worlds/deepracer/env/sensor_rendering.py",
    ),
    Quirk(
        "box_distance_slips",
        "The least distance between boxes whose places are not listed, in metres by its documents, is taken per cent "
        "of the lap, and per cent of that again at each placing: on laps under 100 m it soon is nothing, and the first "
        "of the fixed boxes stands that far past the start line.",
        "It is metres along the centre line, always; every arrangement that keeps it is as likely.",
        "worlds/deepracer/env/placing.py",
    ),
    Quirk(
        "progress_jumps",
        "A car that leaves the road beside another stretch of it is placed on that one: the tick in which it leaves "
        "may gain a third of the lap, be paid for it, and complete the lap.",
        "Without a wheel on the road it stays on the stretch that it left: within 1 m along the centre line, in "
        "progress, waypoints and distance from the centre alike.",
        "worlds/deepracer/env/rules.py",
    ),
    Quirk(
        "corners_collide",
        "A car has hit a box where one of the car's corners lies in the box's rectangle, 0.1 m longer and wider than "
        "the box: a box between two corners is not felt, and air beside it is.",
        "They have hit each other where their rectangles touch.",
        "worlds/deepracer/env/placing.py",
    ),
    Quirk(
        "blame_is_by_lap",
        "Who ran into whom is told by the place on the lap: a bot that has crossed the start line is behind a car that "
        "has not.",
        "By who is ahead, wherever the start line lies.",
        "worlds/deepracer/env/placing.py",
    ),
)
"""Facts: section 11, points 6, 31, 19, 20, 21, 8, 13, 15 and 18; sections 2.2 and 5.4."""

KEPT_IN_BOTH = (
    "Reward and ending speak of the pose the action was chosen at, one tick before the action shows.",
    "`steps` is a float that a racer first sees as 2.0, so that a reward which waits for 1 (or 0) waits for ever; "
    "`x`, `y` are the front of the car; `speed` and `steering_angle` are commands, not what the car does.",
    "`objects_heading` is in rad, 0 of what stands; `objects_speed` is what bots were told, penalty or not.",
    "In a time trial the lists of objects are empty and `closest_objects` is [0, 0].",
    "Globals, class state and function attributes of a reward belong to one car, as they did to one worker, and last "
    "over its episodes.",
)
"""Oddities that racers' files rely on."""

NOT_EMULATED = (
    "Poses read a few milliseconds before or after their frame, and clocks that show it. Ours are of one moment, and "
    "the clock counts 1/15 s a tick.",
    "Momentum that a new episode inherits in the ROS 2 build. Ours start at rest.",
    "Which build counts the row that 59 of AWS's route files repeat: every log of 2020 to 2026 that we have does, the "
    "code of simapp 6.0.5 does not. Ours counts it; `race.waypoints=distinct` does not.",
    "Cars of a metadata version 5 that were driven by the ROS 2 build: the file does not say so. Ours drive as the "
    "console's did, `v5-classic`, unless the racer's folder holds recordings that another car replays better.",
    "Cars that start inside a box, because starts are chosen before boxes are placed: ours start in the other lane or "
    "further back.",
    "`object_in_camera` that speaks of another object than the next, because the car itself is counted among them.",
    "Textures, but for the grain of grass (`camera.grass`). Colours are their means in the light of the car's years.",
    "An evaluation of as many episodes as fit into the trainer's wait. Ours has a fixed number.",
    "A whole job lost to one reward error, one not-a-number or a missing frame. Ours stops and keeps what was learned.",
    "A reward that never returns. Ours is ended after race.reward_seconds, with its line.",
    "A reward that keeps its state over a break: a resumed run loads it anew, and says so where it may keep any.",
)
"""What would be dishonest, or of no use, to rebuild."""


def habits(fidelity: str) -> AwsQuirks:
    """Return the switches of a fidelity.

    >>> habits("aws").prepare_is_learned, habits("sane").prepare_is_learned
    (True, False)
    """
    return AwsQuirks(**{field.name: fidelity == "aws" for field in fields(AwsQuirks)})


def as_table() -> str:
    """Return the departures as a Markdown table."""
    lines = ["| habit | `--fidelity aws`, as the original | `--fidelity sane` |", "|---|---|---|"]
    lines += [f"| {row.habit.replace('_', ' ')} | {row.original} | {row.sane} |" for row in DEPARTURES]
    return "\n".join(lines)
