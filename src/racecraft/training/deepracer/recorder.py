"""An observer that writes down every tick of every car, for the episode files."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.side_by_side import SideBySide
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.training.deepracer.against import AgainstWorld


class EpisodeRecorder:
    """Keeps the ticks of an iteration as columns; `take` hands them over, car by car, and begins anew.

    Of a continuous action there is no number to keep: `action` is -1, and `steering_rad` and `speed_mps` tell it.
    """

    def __init__(self) -> None:
        self._reports: list[Array] = []
        self._rewards: list[Array] = []
        self._varied: list[Array] = []
        self._track_lengths: Array = np.zeros(0)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Write down one tick."""
        assert isinstance(world, RaceWorld | SideBySide | AgainstWorld)
        self._track_lengths = world.track_lengths
        self._reports.append(world.reports.copy())
        if world.variation is not None:
            self._varied.append(world.variation.copy())
        self._rewards.append(buffers.reward.copy())

    def take(self, iteration: int) -> dict[str, Array]:
        """Return the ticks kept since the last call, T x N x M of them, as the columns of `formats/episodes.py`.

        Rows are ordered by world, then by car, then by time. `episode` numbers a car's own episodes from 0. Where a
        world has several cars, the column `agent` numbers them. Where episodes differ, `variation` says by what.
        """
        reports = np.stack(self._reports, axis=2)
        flat = reports.reshape(-1)
        worlds, cars, ticks = reports.shape
        ended = flat["terminated"] | flat["truncated"]
        cut = flat["truncated"] & np.isin(flat["status"], (race.IN_PROGRESS, race.PREPARE))
        columns = {
            "episode": flat["episode"],
            "world": np.repeat(np.arange(worlds), cars * ticks),
            "iteration": np.full(flat.size, iteration),
            "tick": flat["steps"].astype(np.int32),
            "time_s": flat["time"],
            "x_m": flat["front_x"],
            "y_m": flat["front_y"],
            "yaw_rad": flat["yaw"],
            "steering_rad": flat["steering"],
            "speed_mps": flat["speed"],
            "velocity_mps": flat["driven_speed"],
            "action": flat["action"].astype(np.int32),
            "reward": np.stack(self._rewards, axis=2).reshape(-1).astype(np.float64),
            "done": ended,
            "status": np.array(race.STATUSES)[np.where(cut, race.TIME_UP, flat["status"])],
            "all_wheels_on_track": flat["all_wheels_on"],
            "progress_share": flat["progress"] / 100.0,
            "closest_waypoint": flat["waypoint_nearest"],
            "distance_from_center_m": flat["centre_distance"],
            "track_length_m": np.repeat(self._track_lengths, cars * ticks),
        }
        if cars > 1:
            columns["agent"] = np.tile(np.repeat(np.arange(cars), ticks), worlds)
        if self._varied:
            varied = np.stack(self._varied, axis=2).reshape(-1)
            columns["variation"] = varied.astype([(name, "f4") for name in varied.dtype.names or ()])
            self._varied.clear()
        self._reports.clear()
        self._rewards.clear()
        driven = flat["status"] != race.PARK
        return columns if driven.all() else {name: column[driven] for name, column in columns.items()}
