"""Asks the user's reward functions about a tick that was driven.

A reward hears of the road as the car met it: objects and other cars as they stood when the tick's report was written,
not where they have gone since. So what was found before a tick is kept until it is paid.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.objects import OBJECT_STATE, Nearby, ObjectPlan, Objects
from racecraft.worlds.deepracer.env.reward_params import ObjectReports, RewardParams
from racecraft.worlds.deepracer.tracks.track import Track

RewardFunction = Callable[[dict[str, Any]], float]
IS_PAID = np.array([status not in {race.PREPARE, race.PARK, race.PAUSE} for status in range(len(race.STATUSES))])
"""Whether a car of each status earns something, bool (S,)."""


@dataclass(frozen=True, eq=False)
class PaidCourse:
    """What rewards are told of a course that stays the same from tick to tick."""

    waypoints: Array
    """(W, 2), m."""
    length: float
    is_reversed: bool
    objects: dict[str, Any] | None
    """How `ObjectReports` is read there; None: it is empty."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return all but the waypoints, for a process that reads ticks as bytes."""
        report = race.TICK_REPORT.descr
        return {"length": self.length, "reversed": self.is_reversed, "report": report, "objects": self.objects}


class CarRewards(ABC):
    """The reward functions of all cars of a world, asked together once a tick."""

    @abstractmethod
    def __len__(self) -> int:
        """Return how many cars they pay."""

    @abstractmethod
    def compute_rewards(
        self, course: PaidCourse, cars: Array, reports: Array, objects: ObjectReports | None, rewards: Any
    ) -> None:
        """Write what cars earned in a tick.

        Args:
            course: Where they are.
            cars: Which of the cars are paid, int64 (R,).
            reports: TICK_REPORT (R,), theirs.
            objects: What they found around them, R rows.
            rewards: Written at `cars`.

        Raises:
            RewardError: A function failed; rewards of the cars before it were written.
        """


class RewardCaller:
    """What reward functions are told of N worlds of M cars.

    Args:
        track: As cars drive it.
        reverse: Whether it was turned round for that.
        plan: What stands or drives on it.
        objects: Where that is now, in every world.
        around: What each car finds around it, where M > 1.
    """

    def __init__(self, track: Track, reverse: bool, plan: ObjectPlan, objects: Objects, around: Nearby) -> None:
        self._params = RewardParams(track, reverse)
        self._track, self._reverse = track, reverse
        self._plan, self._objects, self._around = plan, objects, around
        self.seen_objects = np.zeros(objects.boxes.shape[:2], OBJECT_STATE)
        """How objects stood when the tick just taken was written down, OBJECT_STATE (N, K)."""
        self.seen_boxes = np.zeros_like(objects.boxes)
        """And where, (N, K, 6), as `boxes`."""
        self._told = [part.copy() for part in self._found]
        """And what each car then found around it: boxes, states and how many of them count, as in `Nearby`."""

    def keep(self, is_asked: bool) -> None:
        """Keep how everything stands before a tick; what single cars find only where a reward is asked."""
        if self._objects.kinds.size:
            self.seen_objects[:], self.seen_boxes[:] = self._objects.states, self._objects.boxes
        if is_asked and self._is_shared:
            for kept, found in zip(self._told, self._found, strict=True):
                kept[:] = found

    def compute_rewards(
        self, reward: RewardFunction | Sequence[RewardFunction] | CarRewards, reports: Array, rewards: Array
    ) -> None:
        """Write what cars earned in a tick.

        Args:
            reward: One for all, or one for each car, N * M of them, perhaps in a process of their own.
            reports: TICK_REPORT (N, M).
            rewards: (N, M), written; cars that wait or were carried off the road earn nothing, and theirs stay.

        Raises:
            RewardError: A function failed; those of the cars before it were written.
        """
        flat, paid = reports.reshape(-1), rewards.flat
        cars = np.flatnonzero(IS_PAID[flat["status"]])
        objects = self._object_reports() if self._around.kinds.size else None
        if isinstance(reward, CarRewards):
            reward.compute_rewards(self._course, cars, flat[cars], None if objects is None else objects.of(cars), paid)
            return
        of_car = [reward] * flat.size if callable(reward) else reward
        for car, params in zip(cars.tolist(), self._params.of(flat[cars], objects, cars), strict=True):
            paid[car] = of_car[car](params)

    @cached_property
    def _course(self) -> PaidCourse:
        objects = None
        if self._around.kinds.size:
            found = self._object_reports()
            objects = {
                "slots": found.states.shape[1],
                "state": OBJECT_STATE.descr,
                "objects": found.objects,
                "drive": found.drive,
                "speed": found.speed,
                "counted": found.counts is not None,
            }
        return PaidCourse(np.asarray(self._track.centre, float), float(self._track.length), self._reverse, objects)

    @property
    def _is_shared(self) -> bool:
        """Whether several cars meet in a world, so that each finds something else around it."""
        return self._around.boxes.shape[1] > 1

    @property
    def _found(self) -> tuple[Array, Array, Array]:
        """What each car finds around it now: boxes, states and how many of them count."""
        return self._around.boxes, self._around.states, self._around.counts

    def _object_reports(self) -> ObjectReports:
        drive, count = bool(self._plan.knots.size), len(self._plan.kinds)
        if not self._is_shared:
            return ObjectReports(self.seen_boxes, self.seen_objects, count, drive, self._plan.speed)
        boxes, states, counts = (column.reshape(-1, *column.shape[2:]) for column in self._told)
        return ObjectReports(boxes, states, count, drive, self._plan.speed, counts)


def require_rewards(reward: RewardFunction | Sequence[RewardFunction] | CarRewards | None, cars: int) -> None:
    """Refuse reward functions that are neither one for all nor one for each car.

    Raises:
        ContractError: They are another number.
    """
    if isinstance(reward, Sequence | CarRewards) and len(reward) != cars:
        raise ContractError(
            "{count} reward functions were given; expected one for all or {cars}", count=len(reward), cars=cars
        )
