"""Each of the original's habits: one row, one switch, and the world with and without it."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import racecraft
from racecraft.contract.world import allocate
from racecraft.training.callbacks import EvaluationResult
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.fidelity import (
    AWS_MAX_TICKS,
    DEPARTURES,
    FIDELITIES,
    WHEEL_KICK,
    AwsQuirks,
    habits,
)
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.evaluator import CarEvaluator

ACTIONS = ActionTable.of([(math.radians(angle), 1.0) for angle in (-30, 0, 30)])
SOURCE = Path(racecraft.__file__).parent


def make_world(fidelity, num_cars=2, **options):
    config = RaceConfig(fidelity=fidelity, **options)
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, lambda params: 1.0,
        race_config=config, camera_config=CameraConfig(16, 12), num_cars=num_cars,
    )  # fmt: skip


def test_each_habit_is_one_row_and_one_switch():
    names = [field.name for field in dataclasses.fields(AwsQuirks)]
    assert [row.habit for row in DEPARTURES] == names
    sources = {path: path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py") if path.name != "fidelity.py"}
    for row in DEPARTURES:
        asked = [
            path.relative_to(SOURCE).as_posix()
            for path, source in sources.items()
            for _ in range(source.count(f".{row.habit}"))
        ]
        assert asked == [row.asked_in], f"{row.habit} is asked in {asked}"
    assert all(getattr(habits("aws"), name) and not getattr(habits("sane"), name) for name in names)


def test_the_prepare_tick_is_learned_from_at_aws_with_no_reward():
    for fidelity, learned in (("aws", True), ("sane", False)):
        world = make_world(fidelity)
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        assert (buffers.active == learned).all()
        world.step(np.ones((2, 1), np.int64), buffers)
        assert buffers.active.all()
        assert (buffers.reward == 0).all(), "the reward function is not called in the prepare tick"


def test_a_cut_is_an_end_at_aws_and_a_cut_where_sane():
    for fidelity in FIDELITIES:
        world = make_world(fidelity, max_episode_seconds=1.0)
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        for _ in range(15):
            assert not buffers.ended.any()
            world.step(np.ones((2, 1), np.int64), buffers)
        assert (buffers.terminated == (fidelity == "aws")).all()
        assert (buffers.truncated == (fidelity == "sane")).all()
        assert {one.status for one in world.pop_episodes()} == {"time_up" if fidelity == "aws" else "truncated"}


def test_episodes_are_endless_at_aws():
    assert make_world("aws")._rules.max_ticks == AWS_MAX_TICKS == 100_000
    assert make_world("sane")._rules.max_ticks == race.max_ticks(100.0)
    assert make_world("aws", max_episode_seconds=2.0)._rules.max_ticks == 30, "who asks for a limit gets it"


class Straight:
    """Drives straight on."""

    def act(self, observations, action_mask=None):
        return np.ones((len(next(iter(observations.values()))), 1), np.int64)

    def reset_state(self, rows):
        """Remembers nothing."""


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_evaluation_starts_where_training_would_only_at_aws(fidelity):
    trained_in, judged = make_world(fidelity, start_advance=0.05), make_world(fidelity, num_cars=4)
    buffers = allocate(trained_in.spec)
    trained_in.reset(buffers, 0)
    while trained_in.cars["episode"][0, 0] < 3:
        trained_in.step(np.ones((2, 1), np.int64), buffers)
    before = trained_in.cars
    verdict = CarEvaluator(judged, Straight(), trained_in).evaluate()
    starts = [lap["start_percent"] for lap in verdict.details["laps"]]
    driven = int(before["episode"].sum())  # as if one car had driven them all, 5 % of the lap each
    assert starts == pytest.approx([5.0 * driven] * 4 if fidelity == "aws" else [0.0, 25.0, 50.0, 75.0])
    assert (trained_in.cars == before).all(), "evaluating moves nothing in the training"


def test_the_episodes_of_an_evaluation_at_aws_begin_alike_and_end_apart():
    """And the next evaluation, after another training episode, is another throw of the same dice."""
    trained_in, judged = make_world("aws"), make_world("aws", num_cars=4)
    trained_in.reset(allocate(trained_in.spec), 0)
    first = CarEvaluator(judged, Straight(), trained_in).evaluate()
    again = CarEvaluator(judged, Straight(), trained_in).evaluate()
    assert first == again
    # Two may leave the road beside the same corner of the centre line, and so with the same progress.
    assert len({lap["progress_percent"] for lap in first.details["laps"]}) >= 3
    trained_in._cars["episode"] += 20  # whole laps of starts on
    assert CarEvaluator(judged, Straight(), trained_in).evaluate() != first


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_of_equal_checkpoints_the_newest_is_best_at_aws_and_else_the_fastest(fidelity):
    judge = CarEvaluator(make_world(fidelity), Straight())

    def judged(seconds):
        report = LapReport((Lap(0, 100.0, seconds, "lap_complete", 100),))
        return EvaluationResult(100.0, True, selection=judge._selection(report))

    fast, slow = judged(8.0), judged(9.0)
    assert slow.takes_the_place_of(fast) is (fidelity == "aws")
    assert fast.takes_the_place_of(slow)


def test_a_tick_is_as_long_as_the_seed_says_and_a_fifteenth_of_a_second_on_average():
    def speeds(fidelity, seed):
        world = make_world(fidelity, num_cars=64)
        buffers = allocate(world.spec)
        world.reset(buffers, seed)
        for _ in range(8):
            before = world.cars
            world.step(np.ones((64, 1), np.int64), buffers)
        return (
            np.hypot(world.cars["x"] - before["x"], world.cars["y"] - before["y"]) / world.cars["speed"] / TICK_SECONDS
        )

    assert (speeds("aws", 1) == speeds("aws", 1)).all()
    assert (speeds("aws", 1) != speeds("aws", 2)).any()
    assert np.ptp(speeds("sane", 1)) < 1e-3
    lengths = speeds("aws", 1)
    assert lengths.min() > 0.9
    assert lengths.max() < 1.1
    assert np.ptp(lengths) > 0.12
    assert lengths.mean() == pytest.approx(speeds("sane", 1).mean(), abs=0.02)


def wheels_of(world, seed, ticks, choice=1):
    """Return the angle of the wheels, rad, tick after tick, (ticks, N); the prepare tick is left out."""
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    world.step(np.full((len(world.cars), 1), choice, np.int64), buffers)
    angles = []
    for _ in range(ticks):
        world.step(np.full((len(world.cars), 1), choice, np.int64), buffers)
        angles.append(world.cars["steering"][:, 0])
    return np.array(angles)


def test_wheels_wander_at_aws_by_their_push_and_come_back_as_they_steer():
    pushed = wheels_of(make_world("aws", num_cars=4000), 1, 12)
    assert (wheels_of(make_world("sane"), 1, 12) == 0.0).all(), "told to stand straight, they do"
    stays = math.exp(-TICK_SECONDS / PROFILES["v6"].steering_lag)  # what a tick leaves of an angle
    first = stays * WHEEL_KICK * math.sqrt(1.0 + stays**2)  # after the prepare tick's push and this one's
    assert pushed[0].std() == pytest.approx(first, rel=0.05)
    settled = stays * WHEEL_KICK / math.sqrt(1.0 - stays**2)
    assert pushed[-1].std() == pytest.approx(settled, rel=0.05)
    assert abs(pushed[-1].mean()) < 4.0 * settled / math.sqrt(4000)
    assert np.corrcoef(pushed[-2], pushed[-1])[0, 1] == pytest.approx(stays, abs=0.04)


def test_the_ideal_car_has_no_weak_hinges():
    assert (wheels_of(make_world("aws", car="kinematic"), 1, 12) == 0.0).all()


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_a_car_put_back_keeps_its_wheels_only_at_aws(fidelity):
    """Two ticks of the last command, one of steering straight: what the replay of real logs starts with, too."""
    world = make_world(fidelity, car="v4", max_episode_seconds=1.0)
    world._rules = world._rules._replace(jitter=0.0, wheel_kick=0.0)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    left = np.full((2, 1), 2, np.int64)
    for _ in range(14):
        world.step(left, buffers)
    driven = world.cars["steering"]
    world.step(left, buffers)
    assert buffers.ended.all()
    told = math.radians(30.0)
    stays = math.exp(-TICK_SECONDS / PROFILES["v4"].steering_lag)
    kept = told + (driven - told) * stays**2 if fidelity == "aws" else 0.0
    assert world.cars["steering"] == pytest.approx(kept)
    world.step(left, buffers)  # the prepare tick
    assert world.cars["steering"] == pytest.approx(kept * stays)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_leaving_the_road_beside_another_stretch_puts_the_car_on_that_one_only_at_aws(fidelity):
    """Where the hairpin of 2022 comes near the straight, a car in between is nearer to the straight: waypoint 104, not
    65, and a third of the lap gained. Sane, it stays on the hairpin, at its own distance from that."""
    track = load_track("2022_reinvent_champ_ccw")
    world = RaceWorld(
        track, ACTIONS, None, race_config=RaceConfig(fidelity=fidelity), camera_config=CameraConfig(16, 12)
    )
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    world.step(np.ones((1, 1), np.int64), buffers)  # the prepare tick
    hairpin, straight = track.centre[65], track.centre[104]
    x, y = 0.45 * hairpin + 0.55 * straight
    car = world._cars[0, 0]
    car["x"], car["y"], car["yaw"], car["speed"] = x, y, math.atan2(*(straight - hairpin)[::-1]), 0.0
    car["arc"], car["progress"] = track.arc[65], 100.0 * track.arc[65] / track.length
    for _ in range(2):
        world.step(np.ones((1, 1), np.int64), buffers)
    report = world.reports[0, 0]
    assert report["status"] == race.OFF_TRACK
    assert (report["progress"] > 90.0) == (fidelity == "aws")
    assert abs(report["waypoint_nearest"] - (104 if fidelity == "aws" else 65)) <= 3
    own = slice(95, 115) if fidelity == "aws" else slice(55, 75)
    nearest = np.linalg.norm(track.centre[own] - (report["front_x"], report["front_y"]), axis=1).min()
    assert report["centre_distance"] == pytest.approx(nearest, abs=0.02)
