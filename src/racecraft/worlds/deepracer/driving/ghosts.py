"""A lap to drive against: where another car was, 15 times a second. Begin with `Ghost`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLap
from racecraft.worlds.deepracer.driving.planner import plan_best_lap
from racecraft.worlds.deepracer.env.actions import OwnActions
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld

REFINEMENTS = 1
"""A person waits for the plan: one refinement comes within a few per cent of the best known lap, in seconds."""


@dataclass(frozen=True, eq=False)
class Ghost:
    """A lap."""

    name: str
    """For people."""
    seconds: float
    path: Array
    """(T, 3) x, y (m) and yaw (rad) of base_link at every tick since the start line."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"name": self.name, "seconds": self.seconds, "path": np.round(self.path, 4).tolist()}


def own_ghost(lap: DrivenLap | None) -> Ghost | None:
    """Return the person's own fastest lap; None where there is none."""
    return None if lap is None else Ghost("your best lap", lap.seconds, lap.path)


def planned_ghost(world: RaceWorld, car: str = "v6") -> Ghost | None:
    """Return a flying lap that is planned for the world's car and driven in its physics; None where none is found.

    Args:
        world: The person's.
        car: Its vehicle profile.
    """
    assert not isinstance(world.actions, OwnActions), "one car has one action space"
    plan = plan_best_lap(world.track, PROFILES[car], world.actions, refinements=REFINEMENTS)
    if plan is None:
        return None
    return Ghost("a planned lap", plan.lap_seconds, plan.path[plan.best_lap][:, :3])
