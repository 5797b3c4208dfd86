"""The lap that a table of actions allows on a track, while it is edited. Begin with `look_at_actions`.

The console calls it in its helper process.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.worlds.deepracer.console.car_values import read_actions
from racecraft.worlds.deepracer.console.circuits import CAR
from racecraft.worlds.deepracer.driving.action_design import design_table, evaluate_table
from racecraft.worlds.deepracer.driving.action_tables import default_top_speed
from racecraft.worlds.deepracer.driving.demand import find_turns, turns_beyond
from racecraft.worlds.deepracer.env.actions import ActionTable, action_space
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.tracks.catalogue import load_track

DEMANDS_SHOWN = 150
MIN_ACTIONS = 4
LONG_M = 30.0
"""On a longer track the lap is planned only where it is asked for: it takes up to half a minute of a core there."""


def design_actions(text: str, track: str, reverse: bool) -> str:
    """Return the actions, as many at most as in a text, that lose least time on a track, one a line.

    Raises:
        UserInputError: The text or the track cannot be used, or no such actions lap the track.
    """
    count, circuit = len(read_actions(text)), load_track(track)
    circuits = [circuit.reversed() if reverse else circuit]
    found = design_table(circuits, PROFILES[CAR], default_top_speed(CAR), max(MIN_ACTIONS, count))
    if found is None or not isinstance(found.actions, ActionTable):
        raise SettingError("no table of {count} actions laps {track}; expected more of them.", count=count, track=track)
    rows = zip(np.degrees(found.actions.steering).round(1), found.actions.speed, strict=True)
    return "\n".join(f"{steering:g}, {speed:g}" for steering, speed in rows)


@lru_cache(maxsize=32)
def look_at_actions(text: str, track: str, reverse: bool, with_lap: bool | None) -> dict[str, Any]:
    """Return what `car_look.html` shows: the best lap in s, turns that no action takes, commands that the lap needs.

    Args:
        text: Of the form, one action a line.
        track: Its name.
        reverse: Whether it is driven the other way round.
        with_lap: Whether the lap is planned; None: on a track of at most LONG_M.
    """
    nothing: dict[str, Any] = {"lap": None, "turns": [], "demand": []}
    try:
        actions = action_space(action_space_from_aws(read_actions(text)))
        circuit = load_track(track)
    except UserInputError:  # the form says so at the field
        return nothing | {"state": "unread"}
    if not (circuit.length <= LONG_M if with_lap is None else with_lap):
        return nothing | {"state": "unplanned"}
    circuit, profile = circuit.reversed() if reverse else circuit, PROFILES[CAR]
    design = evaluate_table([circuit], profile, actions)
    demand = design.demand[:: -(-len(design.demand) // DEMANDS_SHOWN)]
    return {
        "lap": design.laps[0],
        "turns": [str(turn) for turn in turns_beyond(profile, actions, find_turns(circuit, profile))],
        "demand": np.column_stack([np.degrees(demand[:, 0]).round(1), demand[:, 1].round(2)]).tolist(),
        "state": "planned",
    }
