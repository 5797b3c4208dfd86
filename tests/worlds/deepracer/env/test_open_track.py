"""A road that does not close: every drive goes from its start to its finish, in training, judging and races."""

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.laps import judge_laps, judge_starts
from racecraft.worlds.deepracer.evaluation.robustness import judge_under
from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules, judge_race
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import import_track
from racecraft.worlds.deepracer.training.evaluator import CarEvaluator


class StraightOn:
    """Drives its only action."""

    def act(self, observations, action_mask=None):
        return np.zeros(len(next(iter(observations.values()))), np.int64)

    def reset_state(self, rows): ...


def straight(num_cars=1, track=None, actions=((0.0, 1.0),), config=None, **options):
    return RaceWorld(
        track or load_track("Straight_track"), ActionTable.of(list(actions)), options.pop("reward", None),
        race_config=config or RaceConfig(), camera_config=CameraConfig(16, 12), num_cars=num_cars, **options,
    )  # fmt: skip


def test_a_perfect_car_scores_full_from_every_start_and_stops_a_training_by_laps():
    judged, flying = straight(5), straight(start_shares=[0.0], laps=3)
    evaluator = CarEvaluator(judged, StraightOn(), flying=[flying], times_flying=True, known_lap_seconds=5.0)
    result = evaluator.evaluate()
    assert (result.score, result.solved, evaluator.confirm()) == (100.0, True, True)
    laps = result.details["laps"]
    assert {(lap["start_percent"], lap["status"]) for lap in laps} == {(0.0, "lap_complete")}
    assert result.figures["flying_lap_seconds"] == laps[0]["seconds"]


def test_laps_in_a_row_are_drives_from_the_start():
    report = judge_laps(StraightOn(), straight(start_shares=[0.0], laps=3), 3)
    assert [lap.is_full for lap in report.laps] == [True] * 3
    assert len({lap.seconds for lap in report.laps}) == 1
    rules = TrialRaceRules(number_of_trials=3, is_continuous=True)
    record = judge_race(StraightOn(), straight(start_shares=[0.0], laps=rules.laps_in_one), rules)
    assert [trial.status for trial in record.trials] == ["lap_complete"] * 3


@pytest.mark.parametrize("fidelity", ["sane", "aws"])
def test_training_begins_every_episode_at_the_start_and_none_drives_on_over_the_finish(fidelity):
    world = straight(3, config=RaceConfig(fidelity=fidelity, start_offset=0.4), drive_seconds=60.0)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    records = []
    while len(records) < 9:
        world.step(np.zeros((3, 1), np.int64), buffers)
        records += world.pop_episodes()
        assert (world.cars["start_share"] == 0.0).all()
    if fidelity == "sane":  # the original's wheels wander: with them not every drive that is not steered arrives
        assert {record.status for record in records} == {"lap_complete"}
        assert {record.facts["progress_percent"] for record in records} == {100.0}


def test_reward_parameters_tell_the_way_from_start_to_finish():
    seen = []
    world = straight(reward=lambda params: seen.append(dict(params)) or 0.0)
    judge_starts(StraightOn(), world)
    progress = [params["progress"] for params in seen]
    assert progress == sorted(progress)
    assert (seen[0]["progress"] < 5.0, progress[-1]) == (True, 100.0)
    length = world.track.length
    assert seen[40]["progress"] == pytest.approx(100 * (seen[40]["projection_distance"] / length))
    assert seen[0]["closest_waypoints"][0] == 0
    assert seen[-2]["closest_waypoints"] == [20, 21]
    assert not any(params["is_offtrack"] or params["is_reversed"] for params in seen)


def test_a_car_that_begins_further_on_has_the_same_finish():
    world = straight(cars_per_world=2, config=RaceConfig(type="HEAD_TO_MODEL"))
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    ended = {}
    while len(ended) < 2:
        world.step(np.zeros((1, 2), np.int64), buffers)
        for agent in np.flatnonzero(world.reports[0]["status"] == LAP_COMPLETE):
            ended.setdefault(int(agent), world.reports[0, agent]["arc"])
    assert list(ended.values()) == pytest.approx([world.track.length] * 2)


def test_a_disturbed_car_is_judged_from_the_start_too():
    class Car:
        policy = StraightOn()

        def world(self, track, num_cars, start_shares, variation):
            return straight(num_cars, track, start_shares=start_shares, variation=variation)

    (undisturbed, _) = judge_under(Car(), load_track("Straight_track"), "light", tries=3)
    assert undisturbed.report.full_laps == 3


def test_ones_own_road_may_be_open(tmp_path):
    angles = np.linspace(0.0, 0.9, 12)[:, None]
    arc = np.hstack([np.cos(angles), np.sin(angles)])
    rows = np.hstack([5.0 * arc, 4.6 * arc, 5.4 * arc])
    np.save(tmp_path / "bend.npy", rows)
    bend = import_track(tmp_path / "bend.npy")
    assert bend.direction == "open"
    report = judge_starts(StraightOn(), straight(4, bend, [(0.036, 1.0)]))
    assert report.all_full
    assert {lap.start_percent for lap in report.laps} == {0.0}
