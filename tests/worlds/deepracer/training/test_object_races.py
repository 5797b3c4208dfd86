"""A training among boxes or bots, from a racer's run.env to the files it leaves and on from there."""

import json

import numpy as np
import polars
import pytest
from tests.cli.conftest import TINY

from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car, plan_resume
from racecraft.worlds.deepracer.training.race_environment import race_environment

SMALL = (*TINY[1::2], "rollout.num_worlds=4", "rollout.horizon=96")
BOXES = (
    "DR_RACE_TYPE=OBJECT_AVOIDANCE",
    "DR_OA_OBJECT_POSITIONS=0.03,1;0.03,-1;0.28,1;0.28,-1;0.53,1;0.53,-1;0.78,1;0.78,-1",
    "DR_OA_OBSTACLE_TYPE=amazon_box_obstacle",
)
BOTS = (
    "DR_RACE_TYPE=HEAD_TO_BOT",
    "DR_H2B_NUMBER_OF_BOT_CARS=2",
    "DR_H2B_BOT_CAR_SPEED=0.4",
    "DR_H2B_IS_LANE_CHANGE=True",
)


def racer(tmp_path, *lines):
    folder = tmp_path / "my-car"
    folder.mkdir(exist_ok=True)
    (folder / "run.env").write_text("\n".join(("RACECRAFT_STOP=iterations=1", *lines)) + "\n")
    return folder


def train_as_asked(tmp_path, *lines):
    request = RaceRequest(racer(tmp_path, *lines), run=tmp_path / "run", overrides=SMALL)
    return train(request, NullCallback(), lambda _: None)


def test_run_env_becomes_settings_and_notes_name_only_the_other_race(tmp_path):
    asked = race_environment(racer(tmp_path, *BOTS, "DR_OA_NUMBER_OF_OBSTACLES=3"))
    assert set(asked.overrides) == {"race.type=HEAD_TO_BOT", "bots.number=2", "bots.speed=0.4", "bots.lane_change=true"}
    assert "of another race than HEAD_TO_BOT: DR_OA_NUMBER_OF_OBSTACLES" in asked.notes[-1]
    settings = plan_car(RaceRequest(tmp_path / "my-car")).settings
    assert (settings.bots.number, settings.bots.speed, settings.bots.lane_change) == (2, 0.4, True)
    assert "boxes" not in settings


def test_more_boxes_than_fit_are_refused_before_anything_is_written(tmp_path):
    folder = racer(tmp_path, "DR_RACE_TYPE=OBJECT_AVOIDANCE", "DR_OA_NUMBER_OF_OBSTACLES=50")
    with pytest.raises(SettingError, match="boxes.number is 50.* at most"):
        plan_car(RaceRequest(folder, run=tmp_path / "run"))


def test_crashes_stand_in_traces_metrics_and_episodes_and_the_run_goes_on(tmp_path):
    trained = train_as_asked(tmp_path, *BOXES)
    run = trained.run
    ticks = polars.read_parquet(run.episodes / "1.parquet")
    crashed = ticks.filter(polars.col("status") == "crashed")
    assert crashed.height >= 1
    assert crashed["done"].all()
    assert "OBJECT_AVOIDANCE" in (run.path / "training_params.yaml").read_text()
    rows = json.loads((run.path / "metrics" / "TrainingMetrics.json").read_text())["metrics"]
    assert "Crashed" in {row["episode_status"] for row in rows}
    traces = polars.concat(
        [polars.read_csv(path, infer_schema_length=None) for path in run.path.rglob("training-simtrace/*.csv")]
    )
    hits = traces.filter(polars.col("obstacle_crash_counter") == 1)
    assert hits["episode_status"].unique().to_list() == ["crashed"]
    assert hits.height == traces.filter(polars.col("episode_status") == "crashed").height
    settings = plan_resume(run.path).settings
    assert settings.race.type == "OBJECT_AVOIDANCE"
    assert settings.boxes.type == "amazon_box_obstacle"
    again = resume(run.path, ("iterations=2",), NullCallback(), lambda _: None, "deepracer")
    assert len(again.run.read_metrics()) == 2


def test_a_trained_car_meets_the_bots_it_was_trained_among(tmp_path):
    trained = train_as_asked(tmp_path, *BOTS)
    car = load_trained_car(trained.run.path, "last")
    world = car.world(car.trained_on, 2)
    assert world.boxes.shape == (2, 2, 6)
    assert car.settings.bots.speed == 0.4
    reward = trained.run.reward_function.read_text()
    assert "objects_distance" in reward  # nobody gave one: the default pays for the free lane
    assert np.isfinite(trained.run.read_metrics()[0]["policy_loss"])
