"""Cars of every sensor, from a racer's folder to a judged car: trained, gone on with, cloned, drawn."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from racecraft.analysis.report import write_report
from racecraft.cli.app import app
from racecraft.contract.errors import RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import carry_out, resume
from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car

TINY = (
    "camera.width=16", "camera.height=12", "race.max_episode_seconds=4", "rollout.num_worlds=6", "rollout.horizon=60",
    "evaluation.episodes=2", "ppo.epochs=1", "runtime.threads=1", "network.conv_filters=4", "network.conv_kernels=4",
    "network.conv_strides=2", "network.hidden_units=16", "race.type=OBJECT_AVOIDANCE",
)  # fmt: skip
ACTIONS = [{"steering_angle": angle, "speed": 1.0} for angle in (-30, 0, 30)]
CARS = {
    "stereo and sectors": ["STEREO_CAMERAS", "SECTOR_LIDAR"],
    "front and steps": ["DISCRETIZED_SECTOR_LIDAR", "FRONT_FACING_CAMERA"],
}


def brought(folder, sensors, **more):
    folder.mkdir()
    metadata = {"action_space": ACTIONS, "sensor": sensors, "version": "6", **more}
    (folder / "model_metadata.json").write_text(json.dumps(metadata))
    return folder


def train(folder, run, iterations=1, **more):
    stops = (f"iterations={iterations}",)
    plan = plan_car(RaceRequest(folder, overrides=TINY, stops=stops, run=run, **more))
    return carry_out("deepracer", plan, NullCallback(), lambda line: None)


@pytest.fixture(scope="module", params=CARS)
def trained(request, tmp_path_factory):
    """A run of one iteration, and its car's sensors."""
    home = tmp_path_factory.mktemp("sensors")
    sensors = CARS[request.param]
    return train(brought(home / "car", sensors), home / "run").run, sensors


def test_its_policy_sees_every_sensor_and_drives(trained):
    run, names = trained
    policy = load_policy(run.path)
    assert set(policy.spec.visible) == set(names)
    car = load_trained_car(run.path)
    assert car.sensors == car_sensors(names)
    seen = {name: np.zeros((2, *part.shape), part.dtype) for name, part in policy.spec.visible.items()}
    asked = [policy.probabilities({**seen, name: seen[name] + 1}) for name in names]
    assert all((likely != policy.probabilities(seen)).any() for likely in asked), "every input has a say"
    drive = drive_laps(car, car.trained_on, laps=1)
    assert len(drive.ticks) > 5


@pytest.mark.parametrize("trained", ["stereo and sectors"], indirect=True)
def test_its_files_tell_of_its_sensors(trained, tmp_path):
    run, names = trained
    assert json.loads(run.model_metadata.read_text())["sensor"] == names
    assert write_report(RunFolder.open(run.path), tmp_path / "page.html").is_file()


def test_a_run_that_goes_on_is_the_run_that_was_not_interrupted(tmp_path):
    """With a LiDAR that reads ten times a second, so that a reading stands over the break."""
    folder = brought(tmp_path / "car", ["STEREO_CAMERAS", "LIDAR"])
    whole = train(folder, tmp_path / "whole", iterations=2, fidelity="aws").run
    broken = train(folder, tmp_path / "broken", iterations=1, fidelity="aws").run
    resume(broken.path, ("iterations=2",), NullCallback(), lambda line: None)
    one, other = (Checkpoints(run.checkpoints).load_policy("last")[0] for run in (whole, broken))
    assert one.keys() == other.keys()
    assert all((one[name] == other[name]).all() for name in one)


def test_a_clone_with_other_sensors_is_refused_with_the_reason(tmp_path):
    first = train(brought(tmp_path / "one", ["STEREO_CAMERAS", "SECTOR_LIDAR"]), tmp_path / "run").run
    other = brought(tmp_path / "two", ["FRONT_FACING_CAMERA"])
    told = "was trained with STEREO_CAMERAS and SECTOR_LIDAR of 8 sectors .* now the car sees with FRONT_FACING_CAMERA;"
    with pytest.raises(RunFolderError, match=told):
        train(other, tmp_path / "clone", clone_from=str(first.path))
    same = brought(tmp_path / "three", ["SECTOR_LIDAR", "STEREO_CAMERAS"])
    train(same, tmp_path / "allowed", clone_from=str(first.path))


def test_what_the_network_sees_is_drawn(tmp_path):
    folder = brought(tmp_path / "car", ["STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"], lidar_config={"num_sectors": 4})
    picture = tmp_path / "seen.png"
    words = ["sensors", str(folder), "--at", "0.3", "-o", str(picture), "--json", *(f"--set={word}" for word in TINY)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["observations"]["STEREO_CAMERAS"]["shape"] == [12, 16, 2]
    assert len(told["observations"]["DISCRETIZED_SECTOR_LIDAR"]["values"]) == 4 * 8
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture.stat().st_size > 20_000
