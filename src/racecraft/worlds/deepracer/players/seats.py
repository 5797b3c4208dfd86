"""Who drives which car of a world of several. Begin with `Seats.choose`.

A driver that sees as the world's own cars do is given what the world shows; one with another camera or another LiDAR is
shown what these see from its car.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.lidar_config import BEAMS
from racecraft.worlds.deepracer.players.driver import Driver

NOBODY = -1


class Seats:
    """Drivers in the cars of N worlds of M.

    Args:
        world: Made with `OwnActions` of all cars.
        own: Whoever sees what the world shows.
        drivers: Who drives.
        whose: (N, M) the number of each car's driver; NOBODY: somebody else's affair.
    """

    def __init__(self, world: RaceWorld, own: Driver, drivers: Sequence[Driver], whose: Array) -> None:
        self._world, self._drivers = world, tuple(drivers)
        self._rows = [np.ascontiguousarray(np.argwhere(whose == number)) for number in range(len(self._drivers))]
        self._cameras = [self._camera_of(driver, own) for driver in self._drivers]
        self._ranges = [np.zeros((len(rows), BEAMS)) for rows in self._rows]
        for driver, rows in zip(self._drivers, self._rows, strict=True):
            profile = PROFILES[driver.car]
            profile = profile._replace(speed_gain=profile.speed_gain * driver.pace)
            world.profiles[rows[:, 0], rows[:, 1]] = race.car_profiles([profile])[0]

    def choose(self, observations: Mapping[str, Array], actions: Array) -> None:
        """Write every driver's choice, as `OwnActions` takes it.

        Args:
            observations: The world's observations, (N, M, ...).
            actions: float64 (N, M, 2), written where somebody drives.
        """
        for number, (driver, rows) in enumerate(zip(self._drivers, self._rows, strict=True)):
            if not len(rows):
                continue
            worlds, cars = rows[:, 0], rows[:, 1]
            camera = self._cameras[number]
            if camera is None:
                seen = {name: array[worlds, cars] for name, array in observations.items()}
            else:
                seen = self._world.look_with(camera, driver.sensors, rows)
                seen |= self._world.look_around_with(driver.sensors, rows, self._ranges[number])
            chosen = np.asarray(driver.policy.act(seen))
            if isinstance(driver.actions, ActionTable):
                actions[worlds, cars, 0] = chosen
            else:
                actions[worlds, cars] = chosen

    def reset_state(self, ended: Array) -> None:
        """Let drivers begin anew in cars (bool (N, M)) whose episode ended."""
        for driver, rows in zip(self._drivers, self._rows, strict=True):
            own = ended[rows[:, 0], rows[:, 1]]
            if own.any():
                driver.policy.reset_state(own)

    def save_state(self) -> dict[str, Array]:
        """Return what LiDARs read last that are no world's: a reading stands until the next is due."""
        return {f"seat.{number}.ranges": ranges.copy() for number, ranges in enumerate(self._ranges)}

    def load_state(self, state: Mapping[str, Array]) -> None:
        """Go on from a saved state; what an older one lacks is read at the next turn of the LiDAR."""
        for number, ranges in enumerate(self._ranges):
            ranges[:] = state.get(f"seat.{number}.ranges", ranges)

    def _camera_of(self, driver: Driver, own: Driver) -> Camera | None:
        return None if driver.sees_like(own) else driver.camera(self._world.drawn_track)
