import importlib.util

import numpy as np
import pytest

from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.actions.line import line
from racecraft.worlds.deepracer.driving import planner
from racecraft.worlds.deepracer.driving.action_tables import default_table, read_table
from racecraft.worlds.deepracer.driving.guides import guides
from racecraft.worlds.deepracer.driving.kernels.road_raster import CELL_M, INSIDE, OUTSIDE
from racecraft.worlds.deepracer.driving.lines import classical_line
from racecraft.worlds.deepracer.driving.planner import drive_plan, plan_best_lap, road_raster
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.tracks.catalogue import load_track

HAS_CASADI = importlib.util.find_spec("casadi") is not None


@pytest.fixture(scope="module")
def track():
    return load_track("reinvent_base")


@pytest.fixture(scope="module")
def plan(track):
    return short_plan(track)


def short_plan(track):
    car = PROFILES["v6"]
    line = classical_line(track, car, 2.5, "least-curvature")
    return plan_best_lap(track, car, read_table("7x1.5,2.5"), [line], refinements=0, beam=60)


def test_a_raster_never_contradicts_the_road(track):
    x0, y0, cells = road_raster(track)
    points = np.random.default_rng(1).uniform(
        (x0, y0), (x0 + CELL_M * cells.shape[1], y0 + CELL_M * cells.shape[0]), (4000, 2)
    )
    codes = cells[((points[:, 1] - y0) / CELL_M).astype(int), ((points[:, 0] - x0) / CELL_M).astype(int)]
    on_road = track.contains(points)
    assert on_road[codes == INSIDE].all()
    assert not on_road[codes == OUTSIDE].any()
    assert 0.05 < (codes == INSIDE).mean() < 0.95


def test_a_planned_lap_is_driven_in_the_world_from_rest_to_the_last_finish(track, plan):
    assert len(plan.lap_ticks) == 3
    assert sum(plan.lap_ticks) == len(plan.path)
    assert plan.path[0, 3] == 0.0
    again = drive_plan(track, PROFILES["v6"], plan.commands, plan.choices[1:], len(plan.lap_ticks))
    assert again.lap_ticks == plan.lap_ticks
    assert plan.lap_seconds == min(plan.lap_ticks[1:]) * TICK_SECONDS
    assert 5.5 < plan.lap_seconds < 6.5


def test_the_best_lap_is_driven_anew_from_its_beginning_at_speed(track):
    car, table = PROFILES["v6"], read_table("7x1.5,2.5")
    lines = [classical_line(track, car, 2.5, "centre")]
    first, refined = (plan_best_lap(track, car, table, lines, refinements, 60) for refinements in (0, 1))
    assert refined.lap_seconds < first.lap_seconds
    begins = first.best_lap.start
    assert refined.path[: begins + 1].tolist() == first.path[: begins + 1].tolist()
    assert len(refined.lap_ticks) == first.best_lap_number + 2


def test_a_plan_is_the_same_on_any_number_of_threads(track, plan):
    set_threads(2)
    assert short_plan(track).choices.tolist() == plan.choices.tolist()


def test_a_drive_that_leaves_the_road_is_no_plan(track, plan):
    straight = np.zeros(len(plan.choices), np.int64)
    assert plan.commands[0] == pytest.approx([0.0, 2.5])
    assert drive_plan(track, PROFILES["v6"], plan.commands, straight, 3) is None


def test_a_table_that_cannot_turn_has_no_plan(track):
    table = read_table("7x4")
    car = PROFILES["v4"]
    assert plan_best_lap(track, car, table, [classical_line(track, car, 4.0, "centre")], beam=20) is None


@pytest.mark.skipif(not HAS_CASADI, reason="needs CasADi: pip install 'racecraft[solver]'")
def test_a_bend_that_all_states_come_to_too_fast_is_planned_once_more_with_care(monkeypatch):
    tight, car, table = load_track("Monaco"), PROFILES["v4"], read_table(default_table("v4", 4.0))
    lines = guides(tight, car, table)[:1]
    assert 15.5 < plan_best_lap(tight, car, table, lines, refinements=0, beam=60).lap_seconds < 16.5
    monkeypatch.setattr(planner, "ROUNDS", planner.ROUNDS[:1])
    assert plan_best_lap(tight, car, table, lines, refinements=0, beam=60) is None


def test_the_open_track_is_planned_from_start_to_finish_told_in_seconds_and_written(tmp_path):
    straight, car = load_track("Straight_track"), PROFILES["v6"]
    lines = line("Straight_track", table="3x2.5", out=tmp_path / "line.csv")
    found = lines.as_dictionary()
    assert found["laps_seconds"] == [found["lap_seconds"]] == [round(lines.times.seconds("planned"), 4)]
    assert found["lap_seconds"] == pytest.approx(straight.length / (2.5 * car.speed_gain), abs=0.4)
    assert len(found["out"].read_text().splitlines()) == 1 + round(found["lap_seconds"] / TICK_SECONDS)


@pytest.mark.long
@pytest.mark.skipif(not HAS_CASADI, reason="CasADi is not installed")
@pytest.mark.parametrize(
    ("car", "table", "solved", "planned"),
    [
        ("v6-unlimited", "7x2,3", 4.70, 4.69),
        ("v6-unlimited", "7x2.5,4", 3.53, 3.53),
        ("v5-classic", "7x1,2.2,4", 4.67, 4.69),
        ("v4", "7x1,2,3,4", 5.45, 5.47),
    ],
)
def test_laps_of_reinvent_are_those_of_the_prototypes(track, car, table, solved, planned):
    actions = read_table(table)
    lines = guides(track, PROFILES[car], actions)
    assert lines[0].lap_seconds == pytest.approx(solved, rel=0.01)
    found = plan_best_lap(track, PROFILES[car], actions, lines, refinements=1)
    assert found.lap_seconds == pytest.approx(planned, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize(
    ("car", "table", "planned"), [("v6-unlimited", "7x2,3", 4.69), ("v5-classic", "7x1,2.2,4", 4.69)]
)
def test_without_the_solver_a_plan_loses_a_few_per_cent(track, monkeypatch, car, table, planned):
    monkeypatch.setitem(__import__("sys").modules, "casadi", None)
    found = plan_best_lap(track, PROFILES[car], read_table(table))
    assert found.lap_seconds < 1.05 * planned
