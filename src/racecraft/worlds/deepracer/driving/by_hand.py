"""A car driven by a person, tick by tick, and the laps that the person completes. Begin with `HandDrive`."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from racecraft.algorithms.policy_spec import spec_of_policy
from racecraft.contract.world import Array, allocate
from racecraft.formats.demonstrations import Demonstrations
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, OwnActions
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE, STATUSES
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld

STEERING_WEIGHT = 2.0
"""A wrong angle counts twice as much as a wrong speed where a table lacks the exact pair."""


@dataclass(frozen=True)
class Moment:
    """The car after a tick. Metres, radians, m/s, seconds; left is positive."""

    x: float
    y: float
    yaw: float
    """Pose of base_link."""
    speed: float
    steering: float
    progress: float
    """Per cent of the lap."""
    lap_seconds: float
    """Since this lap began."""
    ended: str
    """How the episode ended in this tick, a word of `race.STATUSES`; "": it goes on."""


@dataclass(frozen=True, eq=False)
class HandLap:
    """A complete lap."""

    seconds: float
    is_flying: bool
    """Whether it began at speed, behind another lap."""
    shown: Demonstrations
    """One episode: what the car saw, and what the person told it."""
    path: Array
    """(T, 3) x, y (m) and yaw (rad) of base_link at every tick."""
    driven: float
    """When, seconds since 1970."""


class HandDrive:
    """One car on a track under a person's hands.

    Args:
        world: One car in one world, without a reward.
    """

    def __init__(self, world: RaceWorld) -> None:
        assert not isinstance(world.actions, OwnActions), "one car has one action space"
        self._world, self._buffers = world, allocate(world.spec)
        self._commands = _Choices(world.actions)
        self._names = [name for name, part in world.spec.observations.items() if not part.privileged]
        self._spec = spec_of_policy(world.spec, "", {}).as_dictionary()
        self.restart()

    def restart(self) -> Moment:
        """Put the car at rest on the start line; the lap under way is dropped."""
        self._world.reset(self._buffers, seed=0)
        self._begin_lap(is_flying=False)
        return self._moment("")

    def tick(self, steering: float, throttle: float) -> tuple[Moment, HandLap | None]:
        """Drive for 1/15 s; return where the car is then, and the lap that it has completed.

        A car that leaves the road stands on the start line again.

        Args:
            steering: -1, full lock right, to 1, full lock left.
            throttle: 0, the slowest speed of the car's actions, to 1, the fastest.
        """
        buffers, choice = self._buffers, self._commands.nearest(steering, throttle)
        if buffers.active[0, 0]:
            self._seen.append({name: buffers.observations[name][0, 0].copy() for name in self._names})
            self._chosen.append(choice)
        self._path.append(self._pose())
        self._world.step(np.asarray(choice)[None, None], buffers)
        self._world.pop_episodes()
        report = self._world.reports[0, 0]
        if not (report["terminated"] or report["truncated"]):
            return self._moment(""), None
        is_lap = int(report["status"]) == LAP_COMPLETE
        lap = self._lap(float(report["lap_seconds"])) if is_lap and self._seen else None
        self._begin_lap(is_flying=is_lap and self._world.track.closed)
        return self._moment(STATUSES[report["status"]]), lap

    def _begin_lap(self, *, is_flying: bool) -> None:
        self._is_flying = is_flying
        self._seen: list[dict[str, Array]] = []
        self._chosen: list[Array] = []
        self._path: list[Array] = []

    def _lap(self, seconds: float) -> HandLap:
        count = len(self._chosen)
        demonstrations = Demonstrations(
            observations={name: np.stack([one[name] for one in self._seen]) for name in self._names},
            actions=np.stack(self._chosen),
            reward=np.zeros(count, np.float32),
            episode=np.zeros(count, np.int32),
            spec=self._spec,
        )
        return HandLap(seconds, self._is_flying, demonstrations, np.stack(self._path), time.time())

    def _pose(self) -> Array:
        car = self._world.cars[0, 0]
        return np.array([car["x"], car["y"], car["yaw"]])

    def _moment(self, ended: str) -> Moment:
        car = self._world.cars[0, 0]
        x, y, yaw, speed, steering, progress = (
            float(car[name]) for name in ("x", "y", "yaw", "speed", "steering", "progress")
        )
        lap_seconds = float(car["lap_ticks"]) * TICK_SECONDS
        return Moment(x, y, yaw, speed, steering, progress, lap_seconds, ended)


class _Choices:
    """What of a car's actions is nearest to what a person does."""

    def __init__(self, actions: ActionSpace) -> None:
        self._box = actions if isinstance(actions, ActionBox) else None
        if self._box is not None:
            (right, left), (slow, fast) = self._box.steering, self._box.speed
            self._most = max(abs(right), abs(left))
        else:
            self._steering, self._speed = np.array(actions.steering), np.array(actions.speed)
            self._most, slow, fast = np.abs(self._steering).max(), self._speed.min(), self._speed.max()
        self._slow, self._range = slow, fast - slow

    def nearest(self, steering: float, throttle: float) -> Array:
        """Return the number of an action, int64 (), or a pair of a continuous space, float32 (2,)."""
        angle = self._most * min(max(steering, -1.0), 1.0)
        speed = self._slow + self._range * min(max(throttle, 0.0), 1.0)
        if self._box is not None:
            return np.array([angle, speed], np.float32)
        off = STEERING_WEIGHT * ((self._steering - angle) / max(self._most, 1e-9)) ** 2
        off = off + ((self._speed - speed) / max(self._range, 1e-9)) ** 2
        return np.asarray(np.argmin(off), np.int64)
