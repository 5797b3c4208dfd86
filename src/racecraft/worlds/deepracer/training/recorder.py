"""An observer that writes down every tick of every car, for the episode files."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld


class EpisodeRecorder:
    """Keeps the ticks of an iteration as columns; `take` hands them over, car by car, and begins anew.

    Of a continuous action there is no number to keep: `action` is -1, and `steering_rad` and `speed_mps` tell it.
    """

    def __init__(self) -> None:
        self._reports: list[Array] = []
        self._rewards: list[Array] = []
        self._varied: list[Array] = []
        self._objects: list[Array] = []
        self._track_lengths: Array = np.zeros(0)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Write down one tick."""
        assert isinstance(world, RaceWorld | MultiCourseWorld | OpponentWorld)
        self._track_lengths = world.track_lengths
        self._reports.append(world.reports.copy())
        if world.variation is not None:
            self._varied.append(world.variation.copy())
        places = places_of_objects(world)
        if places.size:
            self._objects.append(places)
        self._rewards.append(buffers.reward.copy())

    def pop(self, iteration: int) -> dict[str, Array]:
        """Return the ticks kept since the last call, T x N x M of them, as the columns of `formats/episodes.py`.

        Rows are ordered by world, then by car, then by time. `episode` numbers a car's own episodes from 0. Where a
        world has several cars, the column `agent` numbers them. Where episodes differ, `variation` says by what; where
        objects are on the road, `objects` says where they stood.
        """
        # Where NumPy is not told the kind it works out the common one of every two records: four times as slow.
        reports = np.stack(self._reports, axis=2, dtype=self._reports[0].dtype, casting="no")
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
        if self._objects:
            columns["objects"] = _by_name(np.repeat(np.stack(self._objects, axis=1), cars, axis=0))
            self._objects.clear()
        self._reports.clear()
        self._rewards.clear()
        driven = flat["status"] != race.PARK
        return columns if driven.all() else {name: column[driven] for name, column in columns.items()}


def places_of_objects(world: RaceWorld | MultiCourseWorld | OpponentWorld) -> Array:
    """Return where boxes and bots of every world stood in the tick just taken, float32 (N, K, 3): x, y (m), yaw (rad).

    K is that of the course with most of them; where there are fewer, the rest is nan.
    """
    courses = world.courses if isinstance(world, MultiCourseWorld) else (world,)
    seen = [course.seen_boxes for course in courses]
    most = max(boxes.shape[1] for boxes in seen)
    places = np.full((sum(map(len, seen)), most, 3), np.nan, np.float32)
    if not most:
        return places
    first = 0
    for boxes in seen:
        places[first : first + len(boxes), : boxes.shape[1]] = boxes[..., :3]
        first += len(boxes)
    return places


def _by_name(places: Array) -> Array:
    """Return places (R, T, K, 3) as the records of the column `objects`, (R * T,)."""
    count = places.shape[2]
    record = np.dtype([(f"{axis}_{k}", "f4") for k in range(count) for axis in ("x", "y", "yaw")])
    records: Array = np.ascontiguousarray(places.reshape(-1, 3 * count)).view(record)[:, 0]
    return records
