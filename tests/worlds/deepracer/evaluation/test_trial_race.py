"""A judged race on the real world: laps, resets and penalties of a driver whose mistakes are known."""

import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.kernels import starts
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation import trial_race
from racecraft.worlds.deepracer.evaluation.reset_pose import BoxResets, _pose, set_down
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
    [{"number_of_trials": 0}, {"max_resets": -1}, {"off_track_penalty": float("nan")}, {"off_track_penalty": -1}],
)
def test_what_no_race_can_be_is_refused(wrong):
    with pytest.raises(UserInputError, match=next(iter(wrong))):
        TrialRaceRules(**wrong)


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("number_of_trials", 1, 1000),
        ("max_resets", 0, 10_000),
        ("off_track_penalty", 0, 600),
        ("collision_penalty", 0, 600),
        ("reset_behind_dist", 0, 10),
        ("max_resets_after_crash", 1, 1000),
        ("reset_ahead_dist", 0, 10),
    ],
)
def test_each_number_of_a_race_has_a_least_and_a_most(name, least, most):
    for taken in (least, most):
        TrialRaceRules(**{name: taken})
    for refused in (least - 1, most + 1):
        with pytest.raises(UserInputError, match=rf"{name} is {refused}; expected {least:g} to {most:g}\b"):
            TrialRaceRules(**{name: refused})


def test_codes_of_mishaps_are_the_worlds():
    from racecraft.worlds.deepracer.evaluation.mishap_rules import MISHAPS

    assert all(race.STATUSES[code] == word for code, word in MISHAPS.items())


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


def test_resets_of_every_kind_are_counted_together_without_the_mishap_that_ended_the_trial():
    trial = RaceTrial(1, None, 10.0, "time_up", 0, 9, 1, 10, 100, 1000, 5.0)
    assert trial.reset_count == 1111
    assert replace(trial, status="off_track").reset_count == 1110


class Scripted:
    """A world of one car whose ticks are written beforehand: status, terminated, truncated, then other figures."""

    def __init__(self, *rows, kinds=()):
        self.rows, self.seeds, self.told, self.steps = list(rows), [], [], 0
        self.spec = SimpleNamespace(actions=SimpleNamespace(shape=(2,)))
        self.reports = np.zeros((1, 1), race.TICK_REPORT)
        self.kinds, self.seen_boxes = np.array([kinds], np.int64), np.zeros((1, len(kinds), 6))

    def reset(self, buffers, seed):
        self.seeds.append(seed)

    def save_state(self):
        return self.steps

    def step(self, actions, buffers):
        self.told.append(actions.tolist())
        status, terminated, truncated, figures = self.rows[self.steps]
        report = self.reports[0, 0]
        report["status"], report["terminated"], report["truncated"] = status, terminated, truncated
        for name, value in figures.items():
            report[name] = value
        self.steps += 1
        self.seen_boxes += 1.0


class Listens:
    """Says the same always, and notes what it is shown and when it is to forget."""

    def __init__(self):
        self.shown, self.forgot = [], []

    def act(self, observations):
        self.shown.append(observations["seen"].shape)
        return [0.25, 1.5]

    def reset_state(self, rows):
        self.forgot.append((len(self.shown), rows.tolist()))


def judged(monkeypatch, world, rules, **seed):
    """Return the race, who drove it, and how the car was set back: after so many ticks, crashed, held so long."""
    set_back = []
    seen = {"seen": np.zeros((1, 1, 3))}
    monkeypatch.setattr(trial_race, "allocate", lambda spec: SimpleNamespace(observations=seen))

    def note(world, before, crashed, resets, held_ticks, buffers):
        set_back.append((before, crashed, held_ticks))

    monkeypatch.setattr(trial_race, "set_back", note)
    policy = Listens()
    return judge_race(policy, world, rules, **seed), policy, set_back


IN, OFF, LAP = race.IN_PROGRESS, race.OFF_TRACK, race.LAP_COMPLETE
HELD = (race.PAUSE, False, False, {})


def test_two_laps_of_one_drive_are_counted_by_hand(monkeypatch):
    """Off the road: 2 s of 15 ticks; a crash: 1 s. Resets are those of the whole drive: the third mishap ends it."""
    world = Scripted(
        (IN, False, False, {"steps": 1}),
        (OFF, True, False, {"progress": 10.0}),
        *[HELD] * 30,
        (IN, False, False, {}),
        (race.CRASHED, True, False, {}),
        *[HELD] * 15,
        (LAP, False, False, {"lap_seconds": 20.00000012, "progress": 101.0}),
        (IN, False, False, {"lap_seconds": 0.1, "progress": 1.0}),
        (race.IMMOBILISED, True, False, {"progress": 42.5}),
        kinds=(1, 0),
    )
    rules = TrialRaceRules(2, max_resets=2, off_track_penalty=2.0, collision_penalty=1.0)
    record, policy, set_back = judged(monkeypatch, world, rules, seed=4)
    assert record.trials == (
        RaceTrial(1, 20.0, 100.0, "lap_complete", 0, 49, 1, 1, 0, 0, 3.0),
        RaceTrial(2, None, 42.5, "immobilized", 50, 51, 0, 0, 0, 1, 0.0),
    )
    assert [one.reset_count for one in record.trials] == [2, 0]
    assert (len(record), record.full_laps, record.best_lap_seconds) == (2, 1, 20.0)
    assert set_back == [(1, False, 30), (33, True, 15)], "with the state before the tick of the mishap"
    assert policy.forgot == [(0, [True]), (2, [True]), (34, [True])]
    assert set(policy.shown) == {(1, 3)}
    assert world.seeds == [4]
    assert world.told == [[[[0.25, 1.5]]]] * 52, "it is asked while it waits, too"
    waited = [*np.arange(1, 31) / 15], [*2 + np.arange(1, 16) / 15]
    assert record.penalty_seconds.tolist() == [
        round(one, 6) for one in (0, 0, *waited[0], 2, 2, *waited[1], 3, 0, 0)
    ]  # fmt: skip
    assert record.trial.tolist() == [1] * 50 + [2] * 2
    assert record.resets.tolist() == [0, 1, *[1] * 30, 1, 2, *[2] * 15, 2, 0, 0]
    pauses = [*np.arange(30, -1, -1) / 15], [*np.arange(15, -1, -1) / 15]
    np.testing.assert_allclose(record.pause_seconds, [0, *pauses[0], 0, *pauses[1], 0, 0, 0], atol=1e-12)
    words = ["in_progress", "off_track", *["pause"] * 30, "in_progress", "crashed", *["pause"] * 15]
    assert record.status.tolist() == [*words, "lap_complete", "in_progress", "immobilized"]
    boxes, kinds = record.objects
    assert boxes.shape == (52, 2, 6)
    assert kinds.tolist() == [[1, 0]] * 52
    assert boxes[[0, 1, 2], 0, 0].tolist() == [1, 2, 3], "as they were at each tick"


def test_laps_from_the_start_line_are_drives_of_their_own(monkeypatch):
    world = Scripted(
        (OFF, True, False, {"progress": -3.0}),
        (LAP, True, False, {"progress": 100.0, "lap_seconds": 9.0}),
        (IN, False, True, {"progress": 55.0}),
        (race.TIME_UP, True, False, {"progress": 60.0}),
        (race.REVERSED, True, False, {"progress": 5.0}),
    )
    rules = TrialRaceRules(5, is_continuous=False, max_resets=0)
    record, policy, set_back = judged(monkeypatch, world, rules)
    assert record.trials == (
        RaceTrial(1, None, 0.0, "off_track", 0, 0, 0, 1, 0, 0, 0.0),
        RaceTrial(2, 9.0, 100.0, "lap_complete", 1, 1, 0, 0, 0, 0, 0.0),
        RaceTrial(3, None, 55.0, "time_up", 2, 2, 0, 0, 0, 0, 0.0),
        RaceTrial(4, None, 60.0, "time_up", 3, 3, 0, 0, 0, 0, 0.0),
        RaceTrial(5, None, 5.0, "reversed", 4, 4, 0, 0, 1, 0, 0.0),
    )
    assert (set_back, record.objects) == ([], None)
    assert world.seeds == [0, 1, 2, 3, 4], "each with a chance of its own"
    assert [when for when, _ in policy.forgot] == [0, 1, 2, 3, 4]
    assert record.status.tolist() == ["off_track", "lap_complete", "time_up", "time_up", "reversed"]


def test_every_trial_from_the_start_line_has_all_its_resets(monkeypatch):
    drive_of_one = ((OFF, True, False, {}), (LAP, True, False, {"lap_seconds": 9.0}))
    rules = TrialRaceRules(2, is_continuous=False, max_resets=1, off_track_penalty=0.0)
    record, _, set_back = judged(monkeypatch, Scripted(*drive_of_one, *drive_of_one), rules)
    assert [one.status for one in record.trials] == ["lap_complete"] * 2
    assert [how[-1] for how in set_back] == [0, 0]


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


@pytest.mark.parametrize(("crashed", "share"), [(False, 0.3), (True, 0.4)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_car_is_set_down_at_rest_in_the_nearer_lane_and_its_mishaps_are_forgotten(crashed, share, side):
    """It began at 10 % of the lap and had come 30 % of one, 20 % a tick before."""
    _, world = drive(TrialRaceRules(1), Driver(), seconds=1.0)
    car = world.cars[0, :1].copy()
    car["start_share"], car["progress"], car["last_progress"] = 0.1, 30.0, 20.0
    car["x"], car["y"], _ = starts.start_pose(world.track.arrays(), share, 0.9 * side)
    for name in ("speed", "steering", "old_steering", "old_speed", "still_ticks", "backward_ticks", "preparing"):
        car[name] = 1
    car["laps"], car["lap_ticks"] = 2, 77
    set_down(world, car, 0, crashed, BoxResets(1.0))
    lane = starts.start_pose(world.track.arrays(), share, 0.5 * side)
    assert (car["x"][0], car["y"][0], car["yaw"][0]) == pytest.approx(lane)
    assert car["arc"][0] / world.track.length == pytest.approx(share, abs=0.02)
    for name in ("speed", "steering", "old_steering", "old_speed", "still_ticks", "backward_ticks", "preparing"):
        assert car[name][0] == 0, name
    assert (car["laps"][0], car["lap_ticks"][0]) == (2, 77)
