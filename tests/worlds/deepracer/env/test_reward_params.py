"""The dictionary that a user's reward function is handed."""

import math

import numpy as np
import pytest

from racecraft.contract.errors import RewardError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.reward_params import REWARD_PARAMETERS
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.reward_file import load_reward_function
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(-30), 0.6), (math.radians(15), 1.0)])


def drive(reward, choices=((1, 0),) * 4, **options):
    world = RaceWorld(
        load_track("reinvent_base"), ACTIONS, reward, num_cars=2, camera_config=CameraConfig(16, 12), **options
    )
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    rewards = []
    for row in choices:
        world.step(np.array(row)[:, None], buffers)
        rewards.append(buffers.reward[:, 0].copy())
    return world, np.array(rewards)


def seen_params(**options):
    seen = []
    drive(lambda params: seen.append(params) or 1.0, **options)
    return seen


def test_every_key_is_there_with_its_type():
    params = seen_params()[0]
    assert list(params) == list(REWARD_PARAMETERS)
    for name, text in REWARD_PARAMETERS.items():
        kind = text.split(",")[0].split(":")[0].split(" ")[0]
        expected = {"bool": bool, "float": float, "list": list, "[int": list}[kind]
        assert type(params[name]) is expected, name


def test_it_is_called_once_a_car_and_tick_but_not_while_preparing():
    seen = seen_params()
    assert [params["steps"] for params in seen] == [2.0, 2.0, 3.0, 3.0, 4.0, 4.0]


def test_it_speaks_the_dialect_of_aws():
    """Degrees and the command as the table spells it; first car straight at the start of the 2018 track."""
    first, second = seen_params(start_shares=[0.0, 0.5])[:2]
    assert (first["steering_angle"], first["speed"]) == (15.0, 1.0)
    assert (second["steering_angle"], second["speed"]) == (-30.0, 0.6)
    assert first["x"] == pytest.approx(3.1999, abs=2e-3)
    assert first["progress"] == pytest.approx(0.79, abs=0.01)
    assert first["projection_distance"] == pytest.approx(0.14, abs=1e-3)
    assert second["projection_distance"] == pytest.approx(first["track_length"] / 2 + 0.14, abs=0.01)
    assert first["track_length"] == pytest.approx(17.709, abs=2e-3)
    assert first["track_width"] == pytest.approx(0.761, abs=0.01)
    assert first["closest_waypoints"] == [0, 1]
    assert len(first["waypoints"]) == 119
    assert first["waypoints"][0] == first["waypoints"][-1]
    assert first["all_wheels_on_track"]
    assert not first["is_offtrack"]
    assert not first["is_reversed"]


def test_what_a_function_does_to_its_lists_stays_its_own():
    lengths = []

    def spoil(params):
        lengths.append(len(params["waypoints"]))
        params["waypoints"].clear()
        params["closest_waypoints"].append(7)
        return 0.5

    drive(spoil)
    assert set(lengths) == {119}


def test_the_reward_of_a_row_is_that_of_its_own_pose():
    _, rewards = drive(lambda params: params["steps"])
    assert rewards.tolist() == [[0, 0], [2, 2], [3, 3], [4, 4]]


def test_a_function_that_raises_stops_the_world_with_a_letter(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text("def reward_function(params):\n    if params['steps'] > 3:\n        return 1 / 0\n    return 1.0\n")
    with pytest.raises(RewardError) as raised:
        drive(load_reward_function(path).call)
    letter = str(raised.value)
    assert f"{path}:3" in letter
    assert "ZeroDivisionError" in letter
    assert "steps = 4.0" in letter
