"""What run.env says of judging a trained car, by the names of `racecraft evaluate`. Begin with `requested_judging`.

What is not in the file is not in the answer: whether a car is judged as a race at all depends on what is named.
"""

from __future__ import annotations

from dataclasses import replace

from racecraft.contract.message import Message
from racecraft.settings.table import rows_of
from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules
from racecraft.worlds.deepracer.files.run_env import RunEnv
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME

TRIALS, CHECKPOINT = "DR_EVAL_NUMBER_OF_TRIALS", "DR_EVAL_CHECKPOINT"
FLAGS = {"DR_EVAL_IS_CONTINUOUS": "is_continuous", "DR_EVAL_REVERSE_DIRECTION": "reverse_direction"}
RESETS = "DR_EVAL_MAX_RESETS"
AMOUNTS = {
    "DR_EVAL_OFF_TRACK_PENALTY": "off_track_penalty",
    "DR_EVAL_COLLISION_PENALTY": "collision_penalty",
    "DR_EVAL_RESET_BEHIND_DIST": "reset_behind_dist",
}
RANGES = {
    row.name: (row.low, row.high) for row in rows_of(TrialRaceRules) if row.low is not None and row.high is not None
}
"""Least and most of each number of a race."""
VARIABLES = (TRIALS, CHECKPOINT, RESETS, *FLAGS, *AMOUNTS)

Judging = dict[str, bool | int | float | str]
"""What was asked for, by name: "laps", "checkpoint", and the options of a judged race."""


def requested_judging(env: RunEnv) -> Judging:
    """Return what an evaluation does where it is not told otherwise.

    Raises:
        RunEnvError: A value cannot be used; the message names file, line and variable.
    """
    found: Judging = {}
    if TRIALS in env.values:
        found["laps"] = whole_number(env, TRIALS, *RANGES["number_of_trials"])
    if CHECKPOINT in env.values:
        found["checkpoint"] = env.choice(CHECKPOINT, "last", ("last", "best"))
    if RESETS in env.values:
        found["max_resets"] = whole_number(env, RESETS, *RANGES["max_resets"])
    found |= {name: env.flag(variable) for variable, name in FLAGS.items() if variable in env.values}
    for variable, name in AMOUNTS.items():
        if variable in env.values:
            found[name] = env.number(variable, 0.0, *RANGES[name])
    return found


def judging_in_drfc(env: RunEnv) -> Judging:
    """Return what DeepRacer for Cloud does: always a race, and what run.env leaves out is as in a new one.

    Raises:
        RunEnvError: A value cannot be used; the message names file, line and variable.
    """
    new = {name: BY_NAME[name].default for name in VARIABLES}
    return requested_judging(replace(env, values={**new, **env.values}))


def whole_number(env: RunEnv, name: str, low: float, high: float) -> int:
    """Return a value that is a whole number from low to high.

    Raises:
        RunEnvError: It is none.
    """
    number = env.number(name, low, low, high)
    if number != int(number):
        raise env.error_at(name, Message("a whole number from {low:g} to {high:g}", low=low, high=high))
    return int(number)
