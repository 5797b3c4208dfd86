"""A judged race on the real world: laps, resets and penalties of a driver whose mistakes are known."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.reset_pose import BoxResets, _pose
from racecraft.worlds.deepracer.evaluation.trial_race import (
    RaceRecord,
    RaceTrial,
    TrialRaceRules,
    _Marshal,
    judge_race,
)
from racecraft.worlds.deepracer.tracks.catalogue import load_track

sys.path.append(str(Path(__file__).resolve().parents[3]))
from kept_run import ACTIONS, CAMERA, RACE  # noqa: E402
from racecraft.worlds.deepracer.env.actions import action_space  # noqa: E402
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws  # noqa: E402

RIGHT, STRAIGHT, LEFT = range(3)


class Driver:
    """Follows the centre line by what a critic may see; from the ticks given it turns left until it is set back."""

    def __init__(self, mistakes=()):
        self.tick, self.mistakes = 0, list(mistakes)

    def act(self, observations, action_mask=None):
        self.tick += 1
        if self.mistakes and self.tick >= self.mistakes[0]:
            return np.array([LEFT])
        offset, sine, _ = observations["track_state"][0, :3]
        wish = sine + observations["track_state"][0, 9] - 0.8 * offset
        return np.array([LEFT if wish > 0.12 else RIGHT if wish < -0.12 else STRAIGHT])

    def reset_state(self, rows):
        if self.mistakes and self.tick >= self.mistakes[0]:
            self.mistakes.pop(0)


def drive(rules, driver, seconds=60.0, reverse=None, objects=None, config=RACE):
    config = rules.race_config(replace(config, car="kinematic", max_episode_seconds=seconds), reverse)
    actions = [{**action, "speed": 1.0} for action in ACTIONS]
    world = RaceWorld(
        load_track("reinvent_base"),
        action_space(action_space_from_aws(actions)),
        race_config=config,
        camera_config=CAMERA,
        start_shares=[0.0],
        laps=rules.laps_in_one,
        objects=objects,
    )
    return judge_race(driver, world, rules), world


def test_a_clean_race_is_its_laps():
    record, _ = drive(TrialRaceRules(2), Driver())
    assert [one.status for one in record.trials] == ["lap_complete"] * 2
    assert [one.reset_count for one in record.trials] == [0, 0]
    first, second = record.trials
    assert first.begin == 0
    assert second.begin == first.end + 1
    assert first.seconds == pytest.approx((first.end + 1) / 15)
    assert second.seconds == pytest.approx((second.end - first.end) / 15)
    assert record.trial.tolist() == [1] * (first.end + 1) + [2] * (second.end - first.end)
    assert not (record.status == "pause").any()
    assert record.best_lap_seconds == min(first.seconds, second.seconds)


def test_a_mishap_costs_its_penalty_and_goes_on_where_it_was():
    record, world = drive(TrialRaceRules(1, off_track_penalty=4.0), Driver([60]))
    (trial,) = record.trials
    assert (trial.status, trial.off_track_count, trial.penalty_seconds) == ("lap_complete", 1, 4.0)
    waits = np.flatnonzero(record.status == "pause")
    assert len(waits) == 60, "four seconds of fifteen ticks"
    off, back = record.ticks[waits[0] - 1], record.ticks[waits[-1] + 1]
    for name in ("x", "y", "yaw", "progress", "waypoint_nearest", "all_wheels_on", "driven_speed"):
        assert (record.ticks[waits][name] == back[name]).all(), (
            f"{name}: it waits where it was set down, not where it was"
        )
    assert (np.diff(record.ticks["steps"]) == 1).all()
    assert record.status[waits[0] - 1] == "off_track"
    assert back["progress"] == pytest.approx(record.ticks[waits[0] - 2]["progress"], abs=1.0), "where it left the road"
    assert back["lap_seconds"] == pytest.approx(off["lap_seconds"] + 4.0 + 1 / 15)
    assert back["steps"] == off["steps"] + 61
    assert back["driven_speed"] == 0.0
    assert back["all_wheels_on"]
    half = back["centre_distance"] / (back["track_width"] / 2)
    assert half == pytest.approx(0.5, abs=0.12), "in a lane, half way to the border"
    assert math.hypot(off["x"] - back["x"], off["y"] - back["y"]) < back["track_width"], "in the nearer of the two"
    np.testing.assert_allclose(record.pause_seconds[waits], np.arange(59, -1, -1) / 15, atol=1e-9)
    assert record.pause_seconds[waits[0] - 1] == pytest.approx(4.0), "the tick of the mishap tells the penalty"
    assert not np.delete(record.pause_seconds, [waits[0] - 1, *waits]).any(), "who drives has nothing left to wait"
    assert trial.seconds == pytest.approx((trial.end + 1) / 15), "penalties are in the lap's time"
    assert record.resets[-1] == 1
    assert record.penalty_seconds[-1] == 4.0
    assert world.spec.num_worlds == 1


def test_where_no_reset_is_left_the_trial_ends():
    record, _ = drive(TrialRaceRules(3, max_resets=1), Driver([20, 200]))
    assert [one.status for one in record.trials] == ["off_track"], "a continuous race is over then"
    assert (record.trials[0].off_track_count, record.trials[0].reset_count) == (2, 1)
    assert record.trials[0].seconds is None
    record, _ = drive(TrialRaceRules(3, is_continuous=False, max_resets=0), Driver([20]))
    assert [one.status for one in record.trials] == ["off_track", "lap_complete", "lap_complete"]
    assert [one.begin for one in record.trials] == [0, record.trials[0].end + 1, record.trials[1].end + 1]
    assert record.full_laps == 2


def test_every_trial_from_the_start_line_has_all_its_resets():
    record, _ = drive(TrialRaceRules(2, is_continuous=False, max_resets=1, off_track_penalty=0.0), Driver([20, 340]))
    assert [(one.status, one.reset_count) for one in record.trials] == [("lap_complete", 1)] * 2


def test_every_mishap_costs_until_resets_are_used_up():
    class Straight(Driver):
        def act(self, observations, action_mask=None):
            return np.array([STRAIGHT])

    record, _ = drive(TrialRaceRules(1, max_resets=2), Straight(), seconds=40.0)
    assert record.trials[0].status == "off_track", "straight on, it leaves the road each time"
    assert record.trials[0].reset_count == 2
    assert record.resets[-1] == 2
    assert record.trials[0].penalty_seconds == 10.0


def test_to_stand_still_costs_no_further_wait():
    rules = TrialRaceRules(off_track_penalty=4.0, collision_penalty=2.0)
    _, world = drive(rules, Driver(), seconds=1.0)
    for status, ticks in ((race.IMMOBILISED, 0), (race.OFF_TRACK, 60), (race.REVERSED, 60), (race.CRASHED, 30)):
        marshal = _Marshal(world, rules)
        report = world.reports[0, 0].copy()
        report["status"], report["terminated"] = status, True
        assert marshal.judge(report)
        assert marshal.held_ticks == ticks


def test_a_wait_takes_nothing_of_the_time_for_driving():
    rules = TrialRaceRules(1, off_track_penalty=60.0)
    record, _ = drive(rules, Driver([20]), seconds=30.0)
    assert (record.trials[0].status, record.trials[0].penalty_seconds) == ("lap_complete", 60.0)


def test_a_car_is_not_set_down_within_a_metre_of_a_box():
    config = replace(RACE, type="OBJECT_AVOIDANCE")
    _, world = drive(TrialRaceRules(1), Driver(), seconds=1.0, objects=BoxesConfig(positions="0.5,1"), config=config)
    length = world.track.length
    for before, arc in ((0.7, 0.5 * length - 1.0), (1.5, 0.5 * length - 1.5)):
        x, y, _ = _pose(world, 0, 0.5 - before / length, (0.0, 0.0), BoxResets(1.0))
        assert float(world.track.locate(np.array([[x, y]])).arc[0]) == pytest.approx(arc, abs=0.1)


def test_with_mercy_every_third_reset_in_a_row_at_one_box_is_ahead_of_it():
    resets = TrialRaceRules(enable_mercy_reset=True, reset_behind_dist=1.5, reset_ahead_dist=0.7).box_resets()
    assert [resets.offset_m(4) for _ in range(6)] == [-1.5, -1.5, 0.7] * 2
    assert [resets.offset_m(box) for box in (4, 4, 0, 4, 4, 4)] == [-1.5] * 5 + [0.7], "another box between counts anew"
    without = TrialRaceRules().box_resets()
    assert [without.offset_m(0) for _ in range(9)] == [-1.0] * 9


def test_mercy_ends_what_a_car_without_chance_does_for_ever():
    """It drives straight on in the lane where it is set down, behind one box and into the next."""
    boxes = BoxesConfig(positions="0.08,1;0.08,-1")
    rules = TrialRaceRules(1, max_resets=9, collision_penalty=0.0, off_track_penalty=0.0)
    stuck, world = drive(rules, Driver(), objects=boxes)
    assert (stuck.trials[0].crash_count, stuck.trials[0].status) == (10, "crashed")
    freed, _ = drive(replace(rules, enable_mercy_reset=True), Driver(), objects=boxes)
    assert (freed.trials[0].crash_count, freed.trials[0].status) == (3, "lap_complete")


def test_bots_drive_on_while_a_car_waits_and_who_ran_into_one_waits_where_it_stands():
    bots = BotsConfig(number=1, speed=0.2)
    rules = TrialRaceRules(1, max_resets=1, collision_penalty=3.0)
    record, _ = drive(rules, Driver(), objects=bots, config=replace(RACE, type="HEAD_TO_BOT"))
    hit = int(np.flatnonzero(record.status == "crashed")[0])
    waits = np.flatnonzero(record.status == "pause")
    assert len(waits) == 45
    place = record.ticks[[hit, waits[0]]]
    assert math.hypot(*(place[name][0] - place[name][1] for name in ("x", "y"))) < 0.01
    boxes, _ = record.objects
    assert math.dist(boxes[waits[0], 0, :2], boxes[waits[-1], 0, :2]) == pytest.approx(0.2 * 44 / 15, abs=0.05)


def test_a_race_ends_by_the_clock():
    record, _ = drive(TrialRaceRules(2), Driver(), seconds=5.0)
    assert [one.status for one in record.trials] == ["time_up"]
    assert len(record.ticks) == 150, "five seconds a lap, for two"


def test_the_other_direction_is_another_race():
    (one, _), (other, _) = drive(TrialRaceRules(1), Driver()), drive(TrialRaceRules(1), Driver(), reverse=True)
    assert other.trials[0].status == "lap_complete"
    assert abs(one.ticks["yaw"][0] - other.ticks["yaw"][0]) == pytest.approx(math.pi, abs=0.2)


def test_a_crash_costs_its_own_penalty_and_is_gone_round():
    """Facts 5.5: a metre behind the box, in the lane that it does not stand in."""
    rules = TrialRaceRules(1, max_resets=1, collision_penalty=2.0, reset_behind_dist=1.2)
    record, world = drive(rules, Driver(), objects=BoxesConfig(positions="0.2,1"), seconds=30.0)
    hit = np.flatnonzero(record.status == "crashed")[0]
    waits = np.flatnonzero(record.status == "pause")
    assert (len(waits), record.trials[0].crash_count) == (30, record.status.tolist().count("crashed"))
    back, box = record.ticks[waits[-1] + 1], world.boxes[0, 0]
    place = world.track.locate(np.array([[box[0], box[1]], [back["x"], back["y"]]]))
    assert place.arc[0] - place.arc[1] == pytest.approx(1.2, abs=0.05)
    assert place.is_left[0] != place.is_left[1]
    assert back["lap_seconds"] == pytest.approx(record.ticks[hit]["lap_seconds"] + 2.0 + 1 / 15)
    boxes, kinds = record.objects
    assert (boxes.shape, kinds.shape) == ((len(record.ticks), 1, 6), (len(record.ticks), 1))
    np.testing.assert_array_equal(boxes[:, 0], np.tile(box, (len(boxes), 1)))
    assert drive(TrialRaceRules(1), Driver(), seconds=1.0)[0].objects is None


@pytest.mark.parametrize(
    "wrong",
    [{"number_of_trials": 0}, {"max_resets": 10_001}, {"off_track_penalty": float("nan")}],
)
def test_what_no_race_can_be_is_refused(wrong):
    with pytest.raises(UserInputError, match=next(iter(wrong))):
        TrialRaceRules(**wrong)


def test_the_files_for_aws_tell_the_same_race(tmp_path):
    import json

    from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
    from racecraft.worlds.deepracer.training.aws.race_evaluation import write_aws_race

    record, world = drive(TrialRaceRules(2, off_track_penalty=2.0), Driver([60]))
    stamp = write_aws_race(tmp_path, record, world.track.length)
    told = json.loads((tmp_path / "metrics" / "evaluation" / f"evaluation-{stamp}.json").read_text())
    assert list(told) == ["metrics"], "without a version, as facts 9.3 has it"
    first, second = told["metrics"]
    assert (first["trial"], first["off_track_count"], first["reset_count"]) == (1, 1, 1)
    assert first["elapsed_time_in_milliseconds"] == round(1000 * record.trials[0].seconds)
    assert (first["episode_status"], second["episode_status"]) == ("In progress", "Lap complete")
    assert second["start_time"] == first["metric_time"]
    trace = read_sim_trace(tmp_path / f"evaluation-{stamp}" / "evaluation-simtrace" / "0-iteration.csv").columns
    assert len(trace["steps"]) == len(record.ticks)
    waits = np.asarray(trace["episode_status"]) == "pause"
    assert waits.sum() == 30
    assert (np.asarray(trace["pause_duration"])[waits][:-1] > 0).all()
    lap = np.asarray(trace["episode"])
    assert (lap == (np.arange(len(lap)) > record.trials[0].end)).all(), "a trial is an episode, as in AWS's own files"
    assert np.asarray(trace["done"]).nonzero()[0].tolist() == [len(lap) - 1], "though the car does not stop between"
    assert (np.diff(trace["steps"]) == 1).all()


def test_the_trace_counts_crashes_within_each_episode(tmp_path):
    from racecraft.worlds.deepracer.env.settings import BoxesConfig
    from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
    from racecraft.worlds.deepracer.training.aws.race_evaluation import write_aws_race

    rules = TrialRaceRules(2, is_continuous=False, max_resets=3, reset_behind_dist=1.2)
    record, world = drive(rules, Driver(), objects=BoxesConfig(positions="0.2,1;0.4,1"), seconds=40.0)
    crashes = [one.crash_count for one in record.trials]
    assert min(crashes) >= 1
    stamp = write_aws_race(tmp_path, record, world.track.length)
    trace = read_sim_trace(tmp_path / f"evaluation-{stamp}" / "evaluation-simtrace" / "0-iteration.csv").columns
    episode, counted = np.asarray(trace["episode"]), np.asarray(trace["obstacle_crash_counter"])
    assert [counted[episode == one].max() for one in (0, 1)] == crashes
    assert counted[episode == 1][0] == 0, "the next trial begins anew"
    for one in (0, 1):
        crashed = np.asarray(trace["episode_status"])[episode == one] == "crashed"
        np.testing.assert_array_equal(counted[episode == one], np.cumsum(crashed))


def test_the_figures_of_a_race_are_those_of_its_trials():
    trials = (
        RaceTrial(1, 10.0, 100.0, "lap_complete", 0, 9, 1, 0, 0, 2, 5.0),
        RaceTrial(2, None, 40.0, "off_track", 10, 19, 0, 3, 0, 0, 7.5),
        RaceTrial(3, 10.1, 100.0, "lap_complete", 20, 29, 0, 0, 4, 0, 0.5),
        RaceTrial(4, 10.0, 100.0, "lap_complete", 30, 30, 0, 0, 0, 0, 0.0),
    )
    nothing = np.zeros(31)
    told = RaceRecord(trials, *[nothing] * 6, None).as_dictionary()
    rows = told.pop("trials")
    assert told == {
        "full_laps": 3, "best_lap_seconds": 10.0, "mean_lap_seconds": 10.033333, "total_seconds": 2.066667,
        "resets": 9, "penalty_seconds": 13.0,
    }  # fmt: skip
    assert [row["reset_count"] for row in rows] == [3, 2, 4, 0]
    assert (rows[1]["trial"], rows[1]["seconds"], rows[1]["off_track_count"]) == (2, None, 3)
    none = RaceRecord(trials[1:2], *[nothing] * 6, None)
    assert (none.full_laps, none.best_lap_seconds, none.as_dictionary()["mean_lap_seconds"]) == (0, None, None)


def test_a_race_of_which_nothing_is_said_is_judged_as_deepracer_for_cloud_does():
    rules = TrialRaceRules()
    assert rules == TrialRaceRules(
        3, True, 1.0, False, 3, 1.0, max_resets=100, off_track_penalty=5.0, collision_penalty=5.0
    )
    assert rules.laps_in_one == 3
    assert replace(rules, is_continuous=False).laps_in_one == 1


@pytest.mark.parametrize(
    ("trained", "asked", "driven"), [(True, None, True), (False, None, False), (True, False, False)]
)
def test_no_start_advances_while_it_is_judged_and_the_direction_is_as_asked(trained, asked, driven):
    config = TrialRaceRules().race_config(replace(RACE, change_start=True, reverse=trained), asked)
    assert (config.change_start, config.reverse) == (False, driven)
