"""What a variable of run.env does to a training that is really driven: found in the files it leaves."""

import json

import numpy as np
import polars
import pytest
from tests.cli.conftest import TINY

from racecraft.contract.world import allocate
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder
from racecraft.worlds.deepracer.files.reward_file import default_reward_source
from racecraft.worlds.deepracer.files.training_params import read_params
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.evaluator import CarEvaluator
from racecraft.worlds.deepracer.training.plan import RaceRequest

SMALL = [setting for setting in TINY[1::2] if not setting.startswith("evaluation.episodes")]
ONE_CAR = (*SMALL, "rollout.num_worlds=1", "rollout.horizon=64", "race.max_episode_seconds=1")


def train_as_asked(tmp_path, *lines, name="run"):
    """Train one car for an iteration as a run.env asks; return what came of it."""
    folder = tmp_path / "my-car"
    folder.mkdir(exist_ok=True)
    (folder / "run.env").write_text("\n".join(("RACECRAFT_STOP=iterations=1", *lines)) + "\n")
    request = RaceRequest(folder, run=tmp_path / name, overrides=ONE_CAR)
    return train(request, NullCallback(), lambda _: None)


def starts(trained):
    """Rows in which an episode begins: place of the car's middle, heading."""
    ticks = polars.read_parquet(trained.run.episodes / "1.parquet").filter(polars.col("tick") == 1)
    x, y, yaw = (ticks[name].to_numpy() for name in ("x_m", "y_m", "yaw_rad"))
    return np.stack([x - FRONT_POINT_M * np.cos(yaw), y - FRONT_POINT_M * np.sin(yaw), yaw], axis=1)


def pose(track, share):
    at = track.pose_at_share(share)
    return [at.x, at.y, at.yaw]


def test_the_first_start_lies_where_it_was_asked_for_and_the_next_ones_stay_there(tmp_path):
    trained = train_as_asked(tmp_path, "DR_TRAIN_START_POSITION_OFFSET=0.25", "DR_TRAIN_CHANGE_START_POSITION=False")
    found, track = starts(trained), load_track("reinvent_base")
    assert len(found) >= 4
    assert found == pytest.approx(np.array([pose(track, 0.25)] * len(found)), abs=1e-6)


def test_starts_advance_by_what_was_asked_for(tmp_path):
    trained = train_as_asked(tmp_path, "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST=0.2", "DR_TRAIN_CHANGE_START_POSITION=True")
    found, track = starts(trained), load_track("reinvent_base")
    assert found == pytest.approx(np.array([pose(track, 0.2 * k % 1) for k in range(len(found))]), abs=1e-6)


def test_the_other_direction_is_the_other_direction_on_the_track_that_was_named(tmp_path):
    trained = train_as_asked(tmp_path, "DR_WORLD_NAME=Oval_track", "DR_TRAIN_REVERSE_DIRECTION=True")
    track = load_track("Oval_track").reversed()
    assert starts(trained)[0] == pytest.approx(np.array(pose(track, 0.0)), abs=1e-6)
    assert trained.run.read_job()["track"]["name"] == "Oval_track"


def test_so_many_trials_are_judged(tmp_path):
    trained = train_as_asked(tmp_path, "DR_TRAIN_MIN_EVAL_TRIALS=3")
    assert len(json.loads((trained.run.evaluations / "1.json").read_text())["laps"]) == 3
    rows = json.loads((trained.run.path / "metrics" / "TrainingMetrics.json").read_text())["metrics"]
    assert sum(row["phase"] == "evaluation" for row in rows) == 3


def test_a_training_ends_when_it_was_told_to(tmp_path):
    trained = train_as_asked(tmp_path, "RACECRAFT_STOP=steps=100")
    assert (trained.outcome.reason, trained.outcome.iterations) == ("steps=100", 2)


@pytest.mark.parametrize("which", ["best", "last"])
def test_an_older_model_lends_its_weights(tmp_path, which):
    train_as_asked(tmp_path, name="old")
    old = Checkpoints(tmp_path / "old" / "checkpoints")
    old.mark(0, 1.0, best=True)
    lines = ("DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED_PREFIX=old")
    new = train_as_asked(tmp_path, *lines, f"DR_LOCAL_S3_PRETRAINED_CHECKPOINT={which}", name="new")
    begun_with, _ = Checkpoints(new.run.checkpoints).load_policy("0")
    lent, _ = old.load_policy(which)
    assert all(np.array_equal(begun_with[name], lent[name]) for name in lent)
    other, _ = old.load_policy("last" if which == "best" else "best")
    assert any(not np.array_equal(begun_with[name], other[name]) for name in other)


def test_the_files_lie_where_it_says(tmp_path):
    (tmp_path / "my-car" / "mine").mkdir(parents=True)
    source = default_reward_source() + "\n# mine\n"
    (tmp_path / "my-car" / "mine" / "reward_function.py").write_text(source)
    trained = train_as_asked(tmp_path, "DR_LOCAL_S3_CUSTOM_FILES_PREFIX=mine")
    assert trained.run.reward_function.read_text() == source


@pytest.mark.parametrize("metric", ["progress", "reward", "laptime"])
def test_the_best_model_is_chosen_by_what_was_asked_for(tmp_path, metric):
    trained = train_as_asked(tmp_path, f"DR_TRAIN_BEST_MODEL_METRIC={metric}")
    assert trained.run.read_job()["settings"]["evaluation"]["best_by"] == metric
    laps = json.loads((trained.run.evaluations / "1.json").read_text())["laps"]
    assert all((lap["reward"] is not None) == (metric == "reward") for lap in laps)
    told = json.loads((trained.run.path / "metrics" / "TrainingMetrics.json").read_text())
    assert told["best_model_metric"] == metric
    marks = json.loads((trained.run.path / "model" / "deepracer_checkpoints.json").read_text())
    meant = {
        "progress": np.mean([lap["progress_percent"] for lap in laps]),
        "reward": np.mean([lap["reward"] or 0 for lap in laps]),
        "laptime": 999_999.0,
    }
    assert marks["best_checkpoint"]["avg_eval_metric"] == pytest.approx(meant[metric])


def test_each_metric_prefers_another_of_two_evaluations():
    """By hand: far and slow against a fast lap beside a failure."""
    far = LapReport((Lap(0, 100, 20.0, "lap_complete", 300, 5.0), Lap(0, 90, None, "off_track", 280, 5.0)))
    paid = LapReport((Lap(0, 40, None, "off_track", 90, 30.0), Lap(0, 40, None, "off_track", 90, 10.0)))
    fast = LapReport((Lap(0, 100, 10.0, "lap_complete", 150, 5.0), Lap(0, 20, None, "off_track", 30, 1.0)))
    reports = {"far": far, "paid": paid, "fast": fast}
    best = {by: max(reports, key=lambda name: reports[name].merit(by)) for by in ("progress", "reward", "laptime")}
    assert best == {"progress": "far", "reward": "paid", "laptime": "fast"}
    assert far.merit("laptime") == -(20_000 + 999_999) / 2


class Straight:
    def act(self, observations, action_mask=None):
        return np.ones((len(next(iter(observations.values()))), 1), np.int64)

    def reset_state(self, rows): ...


def test_a_reward_that_is_compared_is_what_the_reward_function_paid():
    """A point a tick, but none in the tick of preparing."""
    actions = ActionTable.of([(0.5, 1.0), (0.0, 1.0)])
    world = RaceWorld(
        load_track("reinvent_base"), actions, lambda params: 1.0, race_config=RaceConfig(max_episode_seconds=2.0),
        camera_config=CameraConfig(16, 12), num_cars=2,
    )  # fmt: skip
    world.reset(allocate(world.spec), 0)
    result = CarEvaluator(world, Straight(), best_by="reward").evaluate()
    steps = [lap["steps"] for lap in result.details["laps"]]
    assert [lap["reward"] for lap in result.details["laps"]] == [count - 1 for count in steps]
    assert result.selection_metric[0] == np.mean(steps) - 1


def test_domain_randomization_gives_every_episode_lamps_of_its_own(tmp_path):
    one = train_as_asked(tmp_path, "DR_ENABLE_DOMAIN_RANDOMIZATION=True", name="varied").run
    told = polars.read_parquet(one.episodes / "1.parquet")
    drawn = told.unnest("variation").group_by("episode").agg(polars.col("grey_road", "gain").unique())
    assert drawn.height > 2
    assert all(len(road) == 1 for road in drawn["grey_road"]), "the same in every row of an episode"
    assert len({road[0] for road in drawn["grey_road"]}) == drawn.height
    assert {gain[0] for gain in drawn["gain"]} == {1.0}, "the original's has no such thing"
    assert read_params(AwsModelFolder(one.path).training_params)["ENABLE_DOMAIN_RANDOMIZATION"] == "True"
    plain = train_as_asked(tmp_path, "DR_ENABLE_DOMAIN_RANDOMIZATION=False", name="plain").run
    drawn = polars.read_parquet(plain.episodes / "1.parquet").unnest("variation")
    assert drawn["grey_road"].n_unique() == 1
    assert drawn["speed_noise"].n_unique() > 2, "what the preset has of its own stays"
