"""The fastest lap that is certainly possible with a car and its action table. Begin with `plan_best_lap`.

A beam search drives the project's own compiled car. Each tick it tries every action in every state, in longer steps
than the world's, gives up cars that are off the road or far from the guide, and scores the others by the guide's time
at the place they reached, less a price for offset, heading error and excess speed. Nearly equal states are merged, and
the best BEAM live on, driven in the world's own steps. A guide is a line with a speed profile: the solver's, or a
classical one (`guides.py`).

The plan is then driven in `RaceWorld`, and counts only if the marshals count every lap of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.driving.guides import guides
from racecraft.worlds.deepracer.driving.kernels.beam import search
from racecraft.worlds.deepracer.driving.kernels.road_raster import CELL_M, fill_raster
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, ActionTable, clip_commands
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS, CarProfile
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.track import Track

Weights = tuple[float, float, float]
BEAM = 300
LAPS = 4
"""One from rest, then flying."""
WEIGHTS: tuple[Weights, ...] = ((1.0, 0.3, 0.05), (5.0, 2.0, 0.3))
"""Prices of offset, heading error and excess speed: small ones for cars that answer at once, large for others."""
CAREFUL_WEIGHTS: tuple[Weights, ...] = ((5.0, 2.0, 3.0),)
"""Tried where no car came round: all that lived on were too fast to brake for a tight bend."""
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
    def merit(self) -> tuple[float, int]:
        """What plans are compared by: the best lap, then all of them; less is better."""
        return self.lap_seconds, sum(self.lap_ticks)

    @property
    def best_lap(self) -> slice:
        """Rows of the lap that `lap_seconds` speaks of."""
        number = int(np.argmin(self.lap_ticks[1:])) + 1 if len(self.lap_ticks) > 1 else 0
        first = sum(self.lap_ticks[:number])
        return slice(first, first + self.lap_ticks[number])

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

    Every line is followed at every price of WEIGHTS, and of CAREFUL_WEIGHTS where none gave a lap. Then the best lap
    itself is the guide, as long as that gains time.

    Args:
        track: The track, in driving direction.
        car: How the car answers steering and throttle.
        actions: What the car can be told; of ranges a grid is tried.
        lines: Guides; by default `guides.guides`.
        refinements: How often at most the best lap becomes the guide.
        beam: How many states live on after each tick.
    """
    commands, raster = grid_of(actions), road_raster(track)
    lines = list(guides(track, car, actions) if lines is None else lines)

    def follow(line: RacingLine, weights: Weights) -> Plan | None:
        choices = _search(track, raster, car, commands, line, weights, beam)
        return None if choices is None else drive_plan(track, car, commands, choices)

    def follow_all(prices: tuple[Weights, ...]) -> list[tuple[Plan, Weights]]:
        tried = [(follow(line, weights), weights) for line in lines for weights in prices]
        return [(plan, weights) for plan, weights in tried if plan is not None]

    found = follow_all(WEIGHTS) or follow_all(CAREFUL_WEIGHTS)
    if not found:
        return None
    best, weights = min(found, key=lambda pair: pair[0].merit)
    for _ in range(refinements):
        plan = follow(best.line, weights)
        if plan is None or plan.merit >= best.merit:
            break
        best = plan
    return best


GRID_ANGLES, GRID_SPEEDS = 9, 4


def grid_of(actions: ActionSpace) -> np.ndarray:
    """Return (A, 2) the commands a plan may use: a table's, or GRID_ANGLES x GRID_SPEEDS of two ranges."""
    if isinstance(actions, ActionBox):
        angles, speeds = np.linspace(*actions.steering, GRID_ANGLES), np.linspace(*actions.speed, GRID_SPEEDS)
        return clip_commands(np.array([(angle, speed) for angle in angles for speed in speeds]))
    return clip_commands(np.column_stack([actions.steering, actions.speed]).astype(np.float64))


def road_raster(track: Track) -> tuple[float, float, np.ndarray]:
    """Return the road's raster: x and y of its corner (m), and its cells."""
    x0, y0, x1, y1 = track.bounds
    x0, y0 = x0 - 2 * CELL_M, y0 - 2 * CELL_M
    cells = np.zeros((int((y1 - y0) / CELL_M) + 3, int((x1 - x0) / CELL_M) + 3), np.uint8)
    arrays = track.arrays()
    fill_raster(arrays.shell, arrays.hole, x0, y0, cells)
    return x0, y0, cells


def guide_rows(line: RacingLine) -> tuple[np.ndarray, float]:
    """Return a line every GUIDE_SPACING_M as kernels take it, (G, 6), and the exact spacing, m."""
    arc = line.arc
    count = max(8, round(float(arc[-1]) / GUIDE_SPACING_M))
    stations = np.linspace(0.0, arc[-1], count + 1)
    round_it = (lambda values: np.concatenate([values, values[:1]])) if line.closed else (lambda values: values)
    xy = np.column_stack([np.interp(stations, arc, round_it(line.xy[:, k])) for k in (0, 1)])
    speed, seconds = np.interp(stations, arc, round_it(line.speed)), np.interp(stations, arc, line.seconds)
    heading = line.heading
    turned = np.concatenate([heading, [_next_turn(heading)]]) if line.closed else heading
    yaw = np.interp(stations, arc, turned)
    rows = np.column_stack([xy, np.cos(yaw), np.sin(yaw), speed, seconds])
    return np.ascontiguousarray(rows[:-1] if line.closed else rows), float(arc[-1]) / count


def _next_turn(heading: np.ndarray) -> float:
    """Return the first heading of the next lap, without a jump from the last of this one."""
    step = (heading[0] - heading[-1] + np.pi) % (2 * np.pi) - np.pi
    return float(heading[-1] + step)


def _search(
    track: Track, raster: tuple[float, float, np.ndarray], car: CarProfile, commands: np.ndarray, guide: RacingLine,
    weights: Weights, beam: int,
) -> np.ndarray | None:  # fmt: skip
    """Return the rows of `commands` that take a car from rest round its laps, (T,); None without one."""
    rows, spacing = guide_rows(guide)
    length = spacing * len(rows)
    goal = LAPS * length + FRONT_POINT_M if track.closed else length - FRONT_POINT_M
    ticks = int(goal / SLOWEST_MPS / TICK_SECONDS)
    start = np.zeros(7)
    start[:3] = track.pose_at(0.0)
    driven, winner, parents, choices = search(
        track.arrays(), *raster, car, rows, spacing, guide.lap_seconds, track.closed, commands, weights, start, goal,
        beam, ticks,
    )  # fmt: skip
    if winner < 0:
        return None
    plan = np.empty(driven, np.int64)
    for tick in range(driven - 1, -1, -1):
        plan[tick], winner = choices[tick, winner], parents[tick, winner]
    return plan


def drive_plan(track: Track, car: CarProfile, commands: np.ndarray, choices: np.ndarray) -> Plan | None:
    """Drive choices (T,) in `RaceWorld` from rest; return what came of it, None unless all laps were complete."""
    table = ActionTable.of([tuple(command) for command in commands])
    laps = LAPS if track.closed else 1
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
