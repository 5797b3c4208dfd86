"""The fastest lap that is certainly possible with a car and its action table. Begin with `plan_best_lap`.

A beam search drives the project's own compiled car. Each tick it tries in every state the actions that the car answers
differently, in longer steps than the world's, gives up cars that are off the road or far from the guide, and scores the
others by the guide's time at the place they reached, less a price for offset, heading error and excess speed. Nearly
equal states are merged, and the best BEAM live on, driven in the world's own steps. A guide is a line with a speed
profile: the solver's, or a classical one (`guides.py`). The best lap is the next guide, and is driven anew from its own
beginning at speed.

Each plan is then driven in `RaceWorld` from rest, and counts only if the marshals count every lap of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.driving.guides import guides
from racecraft.worlds.deepracer.driving.kernels.beam import STATE_SIZE, search
from racecraft.worlds.deepracer.driving.kernels.road_raster import CELL_M, fill_raster
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, ActionTable, clip_commands
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS, CarProfile
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.track import Track

Weights = tuple[float, float, float]
BEAM = 340
LAPS = 3
"""Along a first guide: one from rest, then flying."""
REFINED_LAPS = 2
"""Along the best lap so far, from its beginning at speed."""
ROUNDS: tuple[tuple[Weights, ...], ...] = (((1.0, 0.3, 0.05), (5.0, 2.0, 0.3)), ((5.0, 2.0, 3.0),), ((10.0, 2.0, 3.0),))
"""Prices of offset, heading error and excess speed, each round tried where no car of those before came round.

First small ones, for cars that answer at once, and large ones for others. Where all that lived on came to a tight bend
too fast to brake, those that keep more to the guide and its speeds."""
GUIDE_SPACING_M = 0.04
REFINEMENTS = 4
SLOWEST_MPS = 0.25
"""A plan that is slower on average is given up."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A drive from rest, tick by tick, that `RaceWorld` counted as complete laps."""

    choices: np.ndarray
    """(T,) row of `commands`; the first tick holds the car at its start and ignores it."""
    commands: np.ndarray
    """(A, 2) angle (rad, positive left) and speed (m/s)."""
    path: np.ndarray
    """(T, 5) x, y (m) and yaw (rad) of base_link, speed (m/s), wheel angle (rad) at the beginning of each tick."""
    lap_ticks: tuple[int, ...]
    """Ticks of each lap; the first begins at rest."""

    @property
    def lap_seconds(self) -> float:
        """The best flying lap, s; on an open track the one lap from rest."""
        return min(self.lap_ticks[1:] or self.lap_ticks) * TICK_SECONDS

    @property
    def best_lap_number(self) -> int:
        """Which lap that is; 0 is the one from rest."""
        return int(np.argmin(self.lap_ticks[1:])) + 1 if len(self.lap_ticks) > 1 else 0

    @property
    def best_lap(self) -> slice:
        """Rows of the lap that `lap_seconds` speaks of."""
        first = sum(self.lap_ticks[: self.best_lap_number])
        return slice(first, first + self.lap_ticks[self.best_lap_number])

    @property
    def line(self) -> RacingLine:
        """The best lap as a line, a point a tick."""
        lap = self.path[self.best_lap]
        is_loop = len(self.lap_ticks) > 1
        return RacingLine(is_loop, lap[:, :2], lap[:, 3], np.arange(len(lap) + is_loop) * TICK_SECONDS)


def plan_best_lap(
    track: Track,
    car: CarProfile,
    actions: ActionSpace,
    lines: Iterable[RacingLine] | None = None,
    refinements: int = REFINEMENTS,
    beam: int = BEAM,
) -> Plan | None:
    """Return the best plan found; None where no car came round.

    Every line is followed at every price of the first of ROUNDS that gives a lap. Then the best lap itself is the
    guide, as long as that gains time.

    Args:
        track: The track, in driving direction.
        car: How the car answers steering and throttle.
        actions: What the car can be told; of ranges a grid is tried.
        lines: Guides; by default `guides.guides`.
        refinements: How often at most the best lap becomes the guide.
        beam: How many states live on after each tick.
    """
    lines = list(guides(track, car, actions) if lines is None else lines)
    course = _Course(track, road_raster(track), car, grid_of(actions), beam)
    found = next(filter(None, (course.plans(lines, prices) for prices in ROUNDS)), [])
    if not found:
        return None
    best, weights = min(found, key=lambda pair: (pair[0].lap_seconds, sum(pair[0].lap_ticks)))
    for _ in range(refinements):
        plan = course.refined(best, weights)
        if plan is None or plan.lap_seconds >= best.lap_seconds:
            break
        best = plan
    return best


GRID_ANGLES, GRID_SPEEDS = 9, 4


def grid_of(actions: ActionSpace) -> np.ndarray:
    """Return (A, 2) the commands a plan may use: a table's, or GRID_ANGLES x GRID_SPEEDS of two ranges.

    Those of small angles come first, fast ones before slow: of commands that a car answers alike the first is tried.
    """
    if isinstance(actions, ActionBox):
        angles, speeds = np.linspace(*actions.steering, GRID_ANGLES), np.linspace(*actions.speed, GRID_SPEEDS)
        commands = np.array([(angle, speed) for angle in angles for speed in speeds])
    else:
        commands = np.column_stack([actions.steering, actions.speed]).astype(np.float64)
    return clip_commands(commands[np.lexsort((-commands[:, 1], np.abs(commands[:, 0])))])


def road_raster(track: Track) -> tuple[float, float, np.ndarray]:
    """Return the road's raster: x and y of its corner (m), and its cells."""
    x0, y0, x1, y1 = track.bounds
    x0, y0 = x0 - 2 * CELL_M, y0 - 2 * CELL_M
    cells = np.zeros((int((y1 - y0) / CELL_M) + 3, int((x1 - x0) / CELL_M) + 3), np.uint8)
    arrays = track.arrays()
    fill_raster(arrays.shell, arrays.hole, x0, y0, cells)
    return x0, y0, cells


def guide_rows(line: RacingLine) -> tuple[np.ndarray, float]:
    """Return a line every GUIDE_SPACING_M as kernels take it, (G, 7), and the exact spacing, m."""
    arc = line.arc
    count = max(8, round(float(arc[-1]) / GUIDE_SPACING_M))
    stations = np.linspace(0.0, arc[-1], count + 1)
    round_it = (lambda values: np.concatenate([values, values[:1]])) if line.closed else (lambda values: values)
    xy = np.column_stack([np.interp(stations, arc, round_it(line.xy[:, k])) for k in (0, 1)])
    speed, seconds = np.interp(stations, arc, round_it(line.speed)), np.interp(stations, arc, line.seconds)
    heading = line.heading
    turned = np.concatenate([heading, [_next_turn(heading)]]) if line.closed else heading
    yaw = np.interp(stations, arc, turned)
    rows = np.column_stack([xy, np.cos(yaw), np.sin(yaw), speed, seconds, yaw])
    return np.ascontiguousarray(rows[:-1] if line.closed else rows), float(arc[-1]) / count


def _next_turn(heading: np.ndarray) -> float:
    """Return the first heading of the next lap, without a jump from the last of this one."""
    step = (heading[0] - heading[-1] + np.pi) % (2 * np.pi) - np.pi
    return float(heading[-1] + step)


@dataclass(frozen=True, eq=False)
class _Course:
    """What all searches for one plan share."""

    track: Track
    raster: tuple[float, float, np.ndarray]
    car: CarProfile
    commands: np.ndarray
    """(A, 2) angle (rad, positive left) and speed (m/s)."""
    beam: int

    def plans(self, lines: Iterable[RacingLine], prices: Iterable[Weights]) -> list[tuple[Plan, Weights]]:
        """Return the plans that come of every line at every price, with that price; none where no car came round."""
        rest = np.zeros(STATE_SIZE)
        rest[:3] = self.track.pose_at(0.0)
        tried = [(self._follow(line, weights, rest, LAPS), weights) for line in lines for weights in prices]
        return [(plan, weights) for plan, weights in tried if plan is not None]

    def refined(self, plan: Plan, weights: Weights) -> Plan | None:
        """Return a plan that drives as this one does to the beginning of its best lap, and then along that lap."""
        first = plan.best_lap.start
        told = plan.commands[plan.choices[first - 1]] if first else np.zeros(2)
        state = np.concatenate([plan.path[first], told])
        return self._follow(plan.line, weights, state, REFINED_LAPS, plan.choices[1:first], plan.best_lap_number)

    def _follow(
        self, guide: RacingLine, weights: Weights, state: np.ndarray, laps: int,
        before: Iterable[int] = (), laps_before: int = 0,
    ) -> Plan | None:  # fmt: skip
        """Return a plan of what was chosen before, (T,), up to this state, and of laps along a guide from there on."""
        laps = laps if self.track.closed else 1
        choices = self._search(guide, weights, state, laps)
        if choices is None:
            return None
        return drive_plan(self.track, self.car, self.commands, np.array([*before, *choices]), laps_before + laps)

    def _search(self, guide: RacingLine, weights: Weights, start: np.ndarray, laps: int) -> np.ndarray | None:
        """Return the rows of `commands` that take a car from a state through its laps, (T,); None without one."""
        rows, spacing = guide_rows(guide)
        length = spacing * len(rows)
        goal = laps * length + FRONT_POINT_M if self.track.closed else length - FRONT_POINT_M
        ticks = int(goal / SLOWEST_MPS / TICK_SECONDS)
        driven, winner, parents, choices = search(
            self.track.arrays(), *self.raster, self.car, rows, spacing, guide.lap_seconds, self.track.closed,
            self.commands, weights, start, goal, self.beam, ticks,
        )  # fmt: skip
        if winner < 0:
            return None
        plan = np.empty(driven, np.int64)
        for tick in range(driven - 1, -1, -1):
            plan[tick], winner = choices[tick, winner], parents[tick, winner]
        return plan


def drive_plan(track: Track, car: CarProfile, commands: np.ndarray, choices: np.ndarray, laps: int) -> Plan | None:
    """Drive choices (T,) in `RaceWorld` from rest; return what came of it, None unless all laps were complete."""
    table = ActionTable.of([tuple(command) for command in commands])
    world = RaceWorld(
        track, table, race_config=RaceConfig(max_episode_seconds=1e6), camera_config=CameraConfig(8, 8),
        laps=laps, start_shares=[0.0], profiles=[car],
    )  # fmt: skip
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    indices = np.concatenate([choices[:1], choices, np.full(30, choices[-1])])
    path: list[list[float]] = []
    lap_ticks: list[int] = []
    for choice in indices:
        world.step(np.array([[choice]]), buffers)
        report = world.reports[0, 0]
        path.append([report[name] for name in ("x", "y", "yaw", "driven_speed", "driven_steering")])
        if report["status"] == LAP_COMPLETE:
            lap_ticks.append(len(path) - sum(lap_ticks))
        if report["terminated"] or report["truncated"]:
            break
    if len(lap_ticks) < laps:
        return None
    return Plan(indices[: len(path)], commands, np.array(path), tuple(lap_ticks))
