"""What lap is possible on a track with a car and a table, by every maker of lines. Begin with `lap_times`."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import MissingExtraError, SettingError
from racecraft.worlds.deepracer.driving.guides import guides, top_speeds
from racecraft.worlds.deepracer.driving.known_laps import FORWARD, REVERSE, best_known_lap
from racecraft.worlds.deepracer.driving.lines import LINES, classical_line
from racecraft.worlds.deepracer.driving.planner import Plan, plan_best_lap
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.solver import solve_line
from racecraft.worlds.deepracer.env.actions import ActionSpace
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.tracks.track import Track

PLANNED, SOLVER = "planned", "solver"
LINE_NAMES = (PLANNED, SOLVER, *LINES)


@dataclass(frozen=True, eq=False)
class LapTimes:
    """Lines of one track, one car and one action table."""

    plan: Plan | None
    """The lap that was driven in `RaceWorld`; None where none was found."""
    lines: dict[str, RacingLine]
    """By name, of LINE_NAMES those that could be made."""
    known_seconds: float | None
    """The best known lap of this car up to this top speed, from the shipped table."""
    top_speed: float
    """The table's fastest command, m/s."""

    @property
    def best_seconds(self) -> float | None:
        """The best lap certainly driven, by this plan or the shipped table, s."""
        laps = [None if self.plan is None else self.plan.lap_seconds, self.known_seconds]
        return min((lap for lap in laps if lap is not None), default=None)

    def seconds(self, name: str) -> float:
        """Return a line's lap time, s: the plan's by the marshals, who on an open track count a held tick."""
        return self.plan.lap_seconds if name == PLANNED and self.plan is not None else self.lines[name].lap_seconds

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures, ready for JSON."""
        return {
            "lap_seconds": None if self.plan is None else round(self.plan.lap_seconds, 4),
            "best_known_seconds": self.best_seconds,
            "laps_seconds": []
            if self.plan is None
            else [round(ticks * TICK_SECONDS, 4) for ticks in self.plan.lap_ticks],
            "estimates_seconds": {
                name: round(line.lap_seconds, 4) for name, line in self.lines.items() if name != PLANNED
            },
        }


def lap_times(track: Track, car: str, actions: ActionSpace, direction: str = FORWARD) -> LapTimes:
    """Plan a lap, and make every other line beside it.

    Args:
        track: The track as filed; it is turned round for REVERSE.
        car: Vehicle profile, a key of `vehicle.PROFILES`.
        actions: What the car can be told.
        direction: FORWARD or REVERSE.
    """
    road = track.reversed() if direction == REVERSE else track
    profile, top_speed = PROFILES[car], float(top_speeds(actions).max())
    lines: dict[str, RacingLine] = {}
    with suppress(MissingExtraError, ArithmeticError):
        lines[SOLVER] = solve_line(road, profile, top_speed)
    lines |= {kind: classical_line(road, profile, top_speed, kind) for kind in LINES}
    plan = plan_best_lap(road, profile, actions, guides(road, profile, actions))
    if plan is not None:
        lines = {PLANNED: plan.line, **lines}
    return LapTimes(plan, lines, best_known_lap(track.name, car, top_speed, direction), top_speed)


def direction_named(track: Track, direction: str) -> str:
    """Return FORWARD or REVERSE for "forward", "reverse", "ccw" or "cw".

    Raises:
        SettingError: Another word, or the reverse of an open track.
    """
    word = direction.lower()
    if word in ("cw", "ccw") and track.closed:
        word = FORWARD if track.direction == word else REVERSE
    if word not in (FORWARD, REVERSE):
        raise SettingError(
            "--direction is {asked!r}; expected forward, reverse, or of a loop cw or ccw.", asked=direction
        )
    if word == REVERSE and not track.closed:
        raise SettingError(
            "--direction is {asked!r}; {name} is an open track: expected forward.", asked=direction, name=track.name
        )
    return word
