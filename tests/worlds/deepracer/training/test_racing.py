"""The preset that races: what it settles, what it leaves alone, and what ends it."""

import json
from types import SimpleNamespace

import polars as pl
import pytest

from racecraft.contract.errors import SettingError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training.callbacks import NullCallback
from racecraft.training.stopping import Progress, parse_stops, reached
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.driving import known_laps
from racecraft.worlds.deepracer.driving.action_tables import default_table, default_top_speed, read_table
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport, judge_starts
from racecraft.worlds.deepracer.files.reward_examples import racing_reward_source
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training import evaluator
from racecraft.worlds.deepracer.training.plan import RaceRequest, known_lap_of, plan_car
from racecraft.worlds.deepracer.training.trainer import drive_seconds


@pytest.mark.parametrize(
    ("asked", "preset"),
    [
        ({}, "race"),
        ({"algorithm": "dqn"}, "fast"),
        ({"tracks": ("Oval_track", "LGSWide")}, "fast"),
        ({"algorithm": "sac", "preset": "race"}, "race"),
    ],
)
def test_one_car_in_a_time_trial_races_unless_somebody_says_otherwise(asked, preset):
    planned = plan_car(RaceRequest(**asked))
    assert planned.request.preset == preset
    assert planned.settings.network.stack_size == (3 if preset == "race" else 1)
    assert (planned.request.stops[0].split("=")[0] == "steps") == (preset == "race")
    grows = planned.settings.rollout.longest_horizon is not None
    assert grows == (preset == "race" and "algorithm" not in asked)


def test_a_folder_that_asks_for_another_algorithm_learns_with_what_suits_it(tmp_path):
    (tmp_path / "model_metadata.json").write_text(
        '{"action_space": {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 1, "high": 2}}, "version": "5",'
        ' "action_space_type": "continuous", "training_algorithm": "sac"}'
    )
    assert plan_car(RaceRequest(tmp_path)).request.preset == "fast"
    assert plan_car(RaceRequest(tmp_path, preset="race")).settings.network.stack_size == 3


def test_the_default_car_stays_within_the_speeds_of_its_logs_and_crawls_by_name():
    assert plan_car(RaceRequest()).actions.fastest == 2.5
    assert plan_car(RaceRequest(preset="fast")).actions.fastest == 1.0


def test_a_table_beyond_the_logs_is_told_so_before_the_first_tick(tmp_path):
    (tmp_path / "model_metadata.json").write_text(
        '{"action_space": [{"steering_angle": 0, "speed": 3.0}, {"steering_angle": 30, "speed": 1.0}], "version": "6"}'
    )
    notes = " ".join(plan_car(RaceRequest(tmp_path)).notes)
    assert "beyond the logs: limits inferred" in notes
    assert "beyond the logs" not in " ".join(plan_car(RaceRequest()).notes)


def test_cars_in_training_drive_on_over_the_finish_and_at_aws_not_at_all():
    planned = plan_car(RaceRequest())
    course = planned.all_courses[0]
    assert drive_seconds(planned, course) == pytest.approx(1.2 * course.track.length / 2.5)
    bends = plan_car(RaceRequest(track="2022_reinvent_champ", car="v5-classic"))
    known = known_lap_of(bends)
    assert 1.5 * known < drive_seconds(bends, bends.all_courses[0]) < 2.0 * known, "time for a full lap from rest"
    told = plan_car(RaceRequest(overrides=("race.max_training_seconds=7",)))
    assert drive_seconds(told, told.all_courses[0]) == 7.0
    assert RaceConfig().max_training_seconds is None
    aws = plan_car(RaceRequest(fidelity="aws"))
    assert drive_seconds(aws, aws.all_courses[0]) is None
    away = plan_car(RaceRequest(track="Straight_track"))
    assert drive_seconds(away, away.all_courses[0]) is None


def test_most_drives_of_a_training_are_short_and_no_evaluation_is(tmp_path):
    assert plan_car(RaceRequest()).settings.race.practice_seconds == 8.0
    assert RaceConfig().practice_seconds is None
    times = ("race.max_training_seconds=1.4", "race.practice_seconds=1", "race.max_episode_seconds=3")
    shape = ("rollout.num_worlds=8", "rollout.horizon=120", "evaluation.episodes=4")
    request = RaceRequest(run=tmp_path / "run", stops=("iterations=1",), overrides=(*times, *shape))
    run = train(request, NullCallback(), lambda text: None).run
    ended = pl.read_parquet(run.episodes / "1.parquet").filter(pl.col("done"))
    lengths = ended.filter(status="time_up")["tick"].value_counts(sort=True).rows()
    assert [length for length, _ in lengths] == [15, 21]
    laps = json.loads((run.evaluations / "1.json").read_text())["laps"]
    assert max(lap["steps"] for lap in laps) > 21
    failed = ended.filter(pl.col("status") != "time_up")["progress_share"].to_list()
    assert run.read_metrics()[0]["training_score"] == pytest.approx(100.0 * sum(failed) / len(failed)), (
        "what was cut is left out"
    )


def test_what_was_judged_of_a_racing_car_is_what_was_kept_the_mean_of_its_latest_weights(tmp_path):
    shape = ("rollout.num_worlds=8", "evaluation.episodes=4", "evaluation.share=none")
    request = RaceRequest(run=tmp_path / "run", stops=("iterations=3",), overrides=shape)
    run = train(request, NullCallback(), lambda text: None).run
    kept, latest = Checkpoints(run.checkpoints), Checkpoints(run.checkpoints).load_state("3")["learner"]["network"]
    assert any((part != latest[name]).any() for name, part in kept.load_policy("3")[0].items())
    for iteration in ("1", "2", "3"):
        car = load_trained_car(run.path, iteration)
        again = judge_starts(car.policy, car.world(car.trained_on, 4))
        told = json.loads((run.evaluations / f"{iteration}.json").read_text())["laps"]
        assert [(lap.status, lap.steps, lap.progress_percent) for lap in again.laps] == [
            (lap["status"], lap["steps"], lap["progress_percent"]) for lap in told
        ]


def test_what_disturbs_a_car_in_training_leaves_its_evaluations_alone_unless_asked():
    planned = plan_car(RaceRequest())
    assert planned.all_courses[0].settings.variation.is_on
    assert not planned.judged_courses[0].settings.variation.is_on
    assert "variation.level=perturbed in training; evaluations are undisturbed" in planned.notes
    asked = plan_car(RaceRequest(overrides=("variation.in_evaluations=true",)))
    assert asked.judged_courses[0].settings.variation.is_on
    assert not any("variation" in note for note in plan_car(RaceRequest(overrides=("variation.level=off",))).notes)
    alone = plan_car(RaceRequest(overrides=("variation.level=off", "variation.lamps=true", "variation.slip=0.2")))
    assert "variation.lamps=1, variation.slip=0.2 in training; evaluations are undisturbed" in alone.notes


def laps_of(seconds, full, of=20):
    """Return what so many full laps, and as many more starts as there are, come to."""
    return LapReport(tuple(
        Lap(0.0, 100.0, seconds, "lap_complete", 200) if k < full else Lap(0.0, 30.0, None, "off_track", 60)
        for k in range(of)
    ))  # fmt: skip


def test_by_pace_one_lucky_evaluation_is_not_the_best(monkeypatch):
    usual, lucky = laps_of(14.5, 19), laps_of(14.0, 20)
    found = iter([laps_of(18.0, 20), *[usual] * 4, lucky, usual, usual, laps_of(14.5, 12), laps_of(19.0, 20)])
    monkeypatch.setattr(evaluator, "judge_starts", lambda *args, **more: next(found))
    world, policy = SimpleNamespace(habits=habits("sane")), None
    latest, best, places = evaluator.LatestReports("pace"), None, []
    for place in range(10):
        resumed = evaluator.LatestReports("pace")  # after each a training may be stopped, and go on
        resumed.restore(latest.state())
        latest = resumed
        judge = evaluator.CarEvaluator(world, policy, best_by="pace", latest=latest)
        result = judge.evaluate()
        if best is None or result.takes_the_place_of(best):
            best = result
            places.append(place)
    assert places == [0, 1, 2, 3, 4, 5, 6, 7], "what leaves the road often, or drives slowly, takes no place"


def test_the_racing_reward_pays_metres_and_takes_a_little_for_steering():
    names = {}
    exec(racing_reward_source(), names)  # noqa: S102 (ours)
    reward = names["reward_function"]
    params = {"progress": 10.0, "steps": 2.0, "steering_angle": 0.0, "track_length": 20.0, "is_offtrack": False}
    assert reward(params) == 0.0
    params |= {"progress": 11.0, "steps": 3.0, "steering_angle": 30.0}
    assert reward(params) == pytest.approx(2 * 0.2 - 0.1)
    params |= {"progress": 12.0, "steps": 4.0, "steering_angle": 0.0}
    assert reward(params) == pytest.approx(2 * 0.2 - 0.1)
    params |= {"progress": 13.0, "steps": 5.0, "steering_angle": -10.0}
    assert reward(params) == pytest.approx(2 * 0.2 - 0.1 / 3 - 0.2), "it last steered to the left"
    params |= {"progress": 14.0, "steps": 6.0, "is_offtrack": True}
    assert reward(params) == pytest.approx(2 * 0.2 - 5, abs=0.1), "at first what two and a half metres pay"
    params |= {"progress": 0.5, "steps": 1.0, "steering_angle": -30.0, "is_offtrack": False}
    assert reward(params) == 0.0, "over the finish another lap begins"
    prices = [-reward(params | {"is_offtrack": True}) for _ in range(800)]
    assert prices == sorted(prices)
    assert prices[-1] == 50.0, "in time what twenty-five metres pay"


def test_a_training_may_wait_for_a_flying_lap_or_its_gap():
    lap, gap = parse_stops(["lap=5.5", "gap=3%"])
    slow, fast = (
        Progress(1.0, 1, 1, False, lap_seconds=5.6, gap_percent=3.1),
        Progress(1.0, 1, 1, False, None, 5.5, 3.0),
    )
    assert reached([lap, gap], slow) is None
    assert (reached([lap], fast), reached([gap], fast)) == (lap, gap)
    assert reached([lap, gap], Progress(1.0, 1, 1, True)) is None, "nobody has timed a lap"


def test_a_gap_to_a_lap_that_nobody_knows_is_refused_and_a_known_one_is_read(tmp_path, monkeypatch):
    request = RaceRequest(stops=("gap=3%", "steps=100"))
    monkeypatch.setattr(known_laps, "TABLE", tmp_path / "none.csv")
    with pytest.raises(SettingError, match=r"gap=3: found no best known lap of reinvent_base.*Say --stop lap="):
        plan_car(request)
    table = tmp_path / "laps.csv"
    table.write_text(
        "track,direction,car,top_speed_mps,table,lap_seconds,how,version\nreinvent_base,forward,v6,2.5,x,5.6,plan,1\n"
    )
    monkeypatch.setattr(known_laps, "TABLE", table)
    assert plan_car(request).stops[0].amount == 3.0
    assert known_laps.best_known_lap("reinvent_base", "v6", 3.0) is None
    assert known_laps.gap_percent(5.88, 5.6) == pytest.approx(5.0)


@pytest.mark.parametrize(("car", "version"), [("v4", "4"), ("v5-classic", "5"), ("v6", "6")])
def test_a_car_asked_for_by_name_brings_the_actions_that_its_best_known_laps_are_driven_with(car, version):
    plan = plan_car(RaceRequest(car=car))
    table = read_table(default_table(car, default_top_speed(car)))
    assert plan.actions.speed == table.speed
    assert plan.actions.steering == pytest.approx(table.steering)
    assert (plan.model.metadata.version, plan.settings.race.car) == (version, car)
    assert known_lap_of(plan) is not None
