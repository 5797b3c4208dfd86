"""Which car a training drives: what was asked, what was recorded, what is written, in this order."""

import json
import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.camera import mount_for_version
from racecraft.worlds.deepracer.env.kernels.vehicle import drive
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, PROFILES
from racecraft.worlds.deepracer.evaluation.recorded_car import recorded_car
from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict, default_model_metadata
from racecraft.worlds.deepracer.files.sim_trace import write_sim_trace
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car
from racecraft.worlds.deepracer.training.trainer import race_world

TINY = ("camera.width=16", "camera.height=12")


def recording(car, path, ticks=200, clocked=1 / 15):
    """Write what a car would have recorded that weaves at 1 to 3 m/s on an endless field."""
    rng = np.random.default_rng(0)
    x = y = yaw = speed = steering = 0.0
    rows, old, command = [], (0.0, 0.0), (0.0, 1.0)
    for tick in range(ticks):
        if tick % 5 == 0:
            command = (rng.uniform(-0.5, 0.5), rng.uniform(1.0, 3.0))
        rows.append((x + FRONT_POINT_M * math.cos(yaw), y + FRONT_POINT_M * math.sin(yaw), yaw, *command))
        to = (0.0, 0.0) if tick == 0 else command
        x, y, yaw, speed, steering = drive(PROFILES[car], x, y, yaw, speed, steering, *old, *to)
        old = to
    front_x, front_y, headings, angles, speeds = np.array(rows).T
    columns = {
        "episode": np.zeros(ticks, np.int64), "steps": np.arange(ticks) + 1.0, "X": front_x, "Y": front_y,
        "yaw": np.degrees(headings), "steer": np.degrees(angles), "throttle": speeds,
        "action": np.zeros(ticks, np.int64), "reward": np.ones(ticks), "done": np.zeros(ticks, bool),
        "all_wheels_on_track": np.ones(ticks, bool), "progress": np.linspace(0, 50, ticks),
        "closest_waypoint": np.zeros(ticks, np.int64), "track_len": np.full(ticks, 17.7),
        "tstamp": np.arange(ticks) * clocked,
        "episode_status": np.where(np.arange(ticks) == 0, "prepare", "in_progress"),
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    write_sim_trace(path, columns)


@pytest.fixture
def folder(tmp_path):
    """Return a function that makes a racer's folder with a metadata version, and recordings of a car in it."""

    def make(version="5", recorded=None):
        home = tmp_path / "my-car"
        home.mkdir()
        metadata = {**as_aws_dict(default_model_metadata()), "version": version}
        (home / "model_metadata.json").write_text(json.dumps(metadata))
        if recorded:
            recording(recorded, home / "sim-trace" / "training" / "training-simtrace" / "0-iteration.csv")
        return home

    return make


@pytest.mark.parametrize("car", ["v4", "v5-classic", "v6"])
def test_the_recorded_car_is_known_by_how_it_drives(tmp_path, car):
    recording(car, tmp_path / "0-iteration.csv")
    found = recorded_car(tmp_path)
    strayed = found.verdict.strayed_m
    assert found.verdict.car == car
    assert strayed[car] < 1e-3 < 0.1 < sorted(strayed.values())[1]
    assert found.rows == 200


@pytest.mark.parametrize(("version", "car"), [("2", "v4"), ("5", "v5-classic"), ("6", "v6")])
def test_without_recordings_the_version_chooses(folder, version, car):
    plan = plan_car(RaceRequest(folder(version), overrides=TINY))
    assert plan.settings.race.car == car
    assert plan.settings.camera.light == ("2019" if version == "2" else "car")


def test_recordings_outweigh_the_version_and_say_so(folder):
    plan = plan_car(RaceRequest(folder("5", recorded="v6"), overrides=TINY))
    assert plan.settings.race.car == "v6"
    note = next(note for note in plan.notes if "the recording shows v6" in note)
    assert "the next car strays" in note
    assert "version says v5-classic" in note


def test_a_recording_that_cannot_tell_leaves_the_car_to_the_version_and_says_so(folder):
    """Each car strays by 10 to 12 cm from a slow recording, as from public ones of version 5 at 0.5 to 1 m/s."""
    home = folder("5")
    recording("v6", home / "0-iteration.csv", ticks=30)
    plan = plan_car(RaceRequest(home, overrides=TINY))
    assert plan.settings.race.car == "v5-classic"
    (note,) = [note for note in plan.notes if "recording" in note]
    assert "cannot tell" in note
    assert "version 5 goes with v5-classic" in note


def test_a_log_that_names_its_build_outweighs_what_the_rows_seem_to_show(folder):
    """Rows of the ROS 2 car beside a log of the classic simulator: that had no such car."""
    home = folder("5", recorded="v6")
    (home / "training-robomaker.log").write_text("SUMMARY\n * /rosdistro: noetic\n * /rosversion: 1.17.0\n")
    assert plan_car(RaceRequest(home, overrides=TINY)).settings.race.car != "v6"
    (home / "training-robomaker.log").write_text("[INFO] [launch]: Default logging verbosity is set to INFO\n")
    plan = plan_car(RaceRequest(home, overrides=TINY))
    assert plan.settings.race.car == "v6"
    assert any("recorded by the ROS 2 build" in note for note in plan.notes)


def test_what_is_asked_for_outweighs_recordings(folder):
    home = folder("5", recorded="v6")
    assert plan_car(RaceRequest(home, car="v4", overrides=TINY)).settings.race.car == "v4"
    assert plan_car(RaceRequest(home, overrides=(*TINY, "race.car=kinematic"))).settings.race.car == "kinematic"


@pytest.mark.parametrize("version", ["2", "4"])
def test_a_training_looks_through_the_mount_of_its_version(folder, version):
    world = race_world(plan_car(RaceRequest(folder(version), overrides=TINY)), 1)
    assert world.camera.mount == mount_for_version(version)
    assert (world.camera.scene.palette[5] == 0.0).all() == (version == "2"), "the black south wall of 2019"


def test_a_repeated_waypoint_is_told(folder):
    home = folder("6")
    told = plan_car(RaceRequest(home, track="Spain_track", overrides=TINY)).notes
    assert any("waypoint 18 of Spain_track" in note and "is counted" in note for note in told)
    told = plan_car(RaceRequest(home, track="Spain_track", overrides=(*TINY, "race.waypoints=distinct"))).notes
    assert any("is not counted" in note for note in told)
    assert not any("waypoint" in note for note in plan_car(RaceRequest(home, overrides=TINY)).notes)
