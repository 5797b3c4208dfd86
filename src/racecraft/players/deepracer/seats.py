"""Who drives which car of a world of several. Begin with `Seats.choose`.

A driver that sees as the world's own cars do is given what the world shows; one with another camera is shown what that
camera sees from its car.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.actions import ActionTable
from racecraft.envs.deepracer.camera import Camera
from racecraft.envs.deepracer.vehicle import PROFILES
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.players.deepracer.driver import Driver

NOBODY = -1


class Seats:
    """Drivers in the cars of N worlds of M.

    Args:
        world: Made with `OwnActions` of all cars.
        own: Whoever sees what the world shows.
        drivers: Who drives.
        whose: (N, M) the number of each car's driver; NOBODY: somebody else's affair.

    Raises:
        SettingError: A driver needs a LiDAR that the world's cars do not carry.
    """

    def __init__(self, world: RaceWorld, own: Driver, drivers: Sequence[Driver], whose: Array) -> None:
        self._world, self._drivers = world, tuple(drivers)
        self._rows = [np.argwhere(whose == number) for number in range(len(self._drivers))]
        self._cameras = [self._camera_of(driver, own) for driver in self._drivers]
        for driver, rows in zip(self._drivers, self._rows, strict=True):
            profile = PROFILES[driver.car]
            profile = profile._replace(speed_gain=profile.speed_gain * driver.pace)
            world.profiles[rows[:, 0], rows[:, 1]] = race.car_profiles([profile])[0]

    def choose(self, shown: Mapping[str, Array], actions: Array) -> None:
        """Write every driver's choice, as `OwnActions` takes it.

        Args:
            shown: The world's observations, (N, M, ...).
            actions: float64 (N, M, 2), written where somebody drives.
        """
        for driver, rows, camera in zip(self._drivers, self._rows, self._cameras, strict=True):
            if not len(rows):
                continue
            worlds, cars = rows[:, 0], rows[:, 1]
            if camera is None:
                seen = {name: array[worlds, cars] for name, array in shown.items()}
            else:
                seen = self._world.look_with(camera, driver.sensors, rows)
            chosen = np.asarray(driver.policy.act(seen))
            if isinstance(driver.actions, ActionTable):
                actions[worlds, cars, 0] = chosen
            else:
                actions[worlds, cars] = chosen

    def forget(self, ended: Array) -> None:
        """Let drivers begin anew in cars (bool (N, M)) whose episode ended."""
        for driver, rows in zip(self._drivers, self._rows, strict=True):
            own = ended[rows[:, 0], rows[:, 1]]
            if own.any():
                driver.policy.forget(own)

    def _camera_of(self, driver: Driver, own: Driver) -> Camera | None:
        if driver.sees_like(own):
            return None
        if driver.sensors.lidar is not None:
            carried = own.sensors.lidar
            raise SettingError(
                f"{driver.name} drives by {driver.sensors.lidar.name} and {own.name} "
                f"{'without a LiDAR' if carried is None else f'sees something else beside {carried.name}'}; expected "
                "cars with the same sensors and camera where one of them has a LiDAR. Race it against its like."
            )
        return driver.camera(self._world.drawn_track)
