"""What a first drive waits for, done before there is one: imports, compiled code. See `warm_up`."""

from __future__ import annotations

import importlib

import numpy as np

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

AHEAD = (
    "racecraft.algorithms.ppo", "racecraft.players.trained", "racecraft.worlds.deepracer.league.drives",
    "racecraft.worlds.deepracer.league.files", "racecraft.worlds.deepracer.logs.one_trace",
)  # fmt: skip
"""Modules that a drive imports."""


def warm_up() -> None:
    """Import what drives need, and step a world without and with boxes once."""
    for name in AHEAD:
        importlib.import_module(name)
    table, track = ActionTable.of([(0.0, 1.0)]), load_track("Oval_track")
    for race, boxes in ((RaceConfig(), None), (RaceConfig(type="OBJECT_AVOIDANCE"), BoxesConfig())):
        world = RaceWorld(track, table, race_config=race, camera_config=CameraConfig(), objects=boxes)
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        world.step(np.zeros((1, 1), np.int64), buffers)
        world.load_state(world.save_state(), buffers)
