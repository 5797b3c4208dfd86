"""A racer's folder with a continuous action space, from its three files to a judged car."""

import json
import logging
import math
import warnings

import numpy as np
import polars as pl
import pytest

from racecraft.analysis.report import write_report
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import carry_out, resume
from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps
from racecraft.worlds.deepracer.env.actions import ActionBox
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training.aws.evaluation import write_aws_evaluation
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car

TINY = (
    "camera.width=16", "camera.height=12", "race.max_episode_seconds=4", "rollout.num_worlds=6", "rollout.horizon=60",
    "evaluation.episodes=2", "ppo.epochs=1", "runtime.threads=1", "network.conv_filters=4", "network.conv_kernels=4",
    "network.conv_strides=2", "network.hidden_units=16", "ppo.initial_std=1",
)  # fmt: skip
METADATA = {
    "action_space": {"steering_angle": {"low": -20, "high": 25}, "speed": {"low": 1, "high": 2}},
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "training_algorithm": "clipped_ppo",
    "action_space_type": "continuous",
    "version": "5",
}
REWARD = """\
def reward_function(params):
    if not -20.0 <= params["steering_angle"] <= 25.0 or not 1.0 <= params["speed"] <= 2.0:
        raise ValueError((params["steering_angle"], params["speed"]))
    at_an_end = params["steering_angle"] in (-20.0, 25.0)
    return 2.0 if at_an_end else 1.0
"""
"""Pays double for an angle that is exactly one of those that the metadata names."""


def brought(folder, **changes):
    folder.mkdir()
    (folder / "model_metadata.json").write_text(json.dumps({**METADATA, **changes}))
    (folder / "reward_function.py").write_text(REWARD)
    return folder


def train(folder, run, iterations):
    plan = plan_car(RaceRequest(folder, overrides=TINY, stops=(f"iterations={iterations}",), run=run))
    return carry_out("deepracer", plan, NullCallback(), lambda line: None)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The run folder of three iterations."""
    home = tmp_path_factory.mktemp("continuous")
    return train(brought(home / "car"), home / "run", 3).run


def test_reward_trace_and_episodes_see_the_same_commands(trained):
    trace = read_sim_trace(AwsModelFolder(trained.path).training_traces()[0])
    assert trace.continuous
    columns = trace.columns
    assert (columns["action"] == -1).all()
    assert columns["steer"].min() == -20.0, "an angle cut to its range is the file's own number"
    assert columns["steer"].max() == 25.0
    assert (columns["throttle"].min(), columns["throttle"].max()) == (1.0, 2.0)
    paid = columns["reward"][columns["episode_status"] != "prepare"]
    ends = np.isin(columns["steer"], (-20.0, 25.0))[columns["episode_status"] != "prepare"]
    assert (paid == np.where(ends, 2.0, 1.0)).all()
    assert 0.2 < ends.mean() < 0.8, "a spread of 1 in [-1, 1] cuts about a third of the angles"
    episodes = pl.concat([pl.read_parquet(path) for path in sorted(trained.episodes.iterdir())])
    assert set(episodes["action"]) == {-1}
    assert episodes["steering_rad"].max() == math.radians(25.0)


def test_a_trace_prints_actions_as_aws_does(trained):
    """A pair in brackets, a space between, every digit: `[-25.0 1.3310375874989868]` in the logs of 2026."""
    first = AwsModelFolder(trained.path).training_traces()[0].read_text().splitlines()[1].split(",")
    assert first[7] == f"[{first[5]} {first[6]}]"


def test_the_car_that_was_trained_drives_within_its_ranges(trained):
    car = load_trained_car(trained.path)
    assert car.actions == ActionBox((math.radians(-20), math.radians(25)), (1.0, 2.0))
    drive = drive_laps(car, plan_car(RaceRequest()).track, laps=1)
    assert (drive.ticks["action"] == -1).all()
    assert (np.abs(drive.ticks["speed"] - 1.5) < 0.3).all(), "a young policy stays near the middle: 0.5 (low + high)"
    stamp = write_aws_evaluation(trained.path, drive.ticks, 1, drive.track.length)
    trace = read_sim_trace(AwsModelFolder(trained.path).evaluation_trace(stamp))
    assert trace.continuous
    np.testing.assert_allclose(trace.columns["steer"], np.degrees(drive.ticks["steering"]), atol=1e-5)


def test_its_report_shows_bands_of_angles(trained, tmp_path):
    text = write_report(RunFolder.open(trained.path), tmp_path / "page.html").read_text()
    assert "mean speed (m/s)" in text
    assert "20° right to 14° right" in text


def test_a_training_that_was_broken_off_goes_on_to_the_same_bits(trained, tmp_path):
    run = tmp_path / "run"
    train(brought(tmp_path / "car"), run, 1)
    resume(run, ("iterations=3",), NullCallback(), lambda line: None)
    at_once, resumed = (Checkpoints(one.checkpoints).load_policy("last")[0] for one in (trained, RunFolder.open(run)))
    assert at_once.keys() == resumed.keys()
    for name, weights in at_once.items():
        np.testing.assert_array_equal(resumed[name], weights, name)


def test_deepracer_utils_reads_a_continuous_training(trained, monkeypatch, caplog):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logs = pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")
        for name in ("AWS_DEFAULT_REGION", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            monkeypatch.setenv(name, "us-east-1")
        log = logs.DeepRacerLog(model_folder=str(trained.path))
        log.load()
        frame = log.dataframe()
    assert log.action_space() == METADATA["action_space"]
    np.testing.assert_allclose(frame["steering_angle"].max(), 25.0)
    assert set(frame["action"]) == {-1}, "its mark of a continuous action"
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING] == []


def test_a_space_beyond_the_car_trains_and_is_said_once(tmp_path):
    wide = {"steering_angle": {"low": -45, "high": 45}, "speed": {"low": 0, "high": 8}}
    folder = brought(tmp_path / "car", action_space=wide)
    (folder / "reward_function.py").write_text("def reward_function(params):\n    return params['speed']\n")
    plan = plan_car(RaceRequest(folder, overrides=TINY, stops=("iterations=1",), run=tmp_path / "run"))
    (said,) = [note for note in plan.notes if "beyond" in note]
    assert said.startswith("model_metadata.json: actions from -45 to 45° and 0 to 8 m/s reach beyond")
    run = carry_out("deepracer", plan, NullCallback(), lambda line: None).run
    episodes = pl.concat([pl.read_parquet(path) for path in sorted(run.episodes.iterdir())])
    assert episodes["steering_rad"].max() == math.radians(30), "what is driven"
    assert episodes["speed_mps"].min() == 0.1
    assert episodes["velocity_mps"].max() < 4.2, "4 m/s at most is sent, and the car drives 3 % faster than told"
    assert episodes["reward"].max() == pytest.approx(4.0)
