"""The car by its Gymnasium id, and the race world before the exam."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.adapter import (
    DeepRacerEnv,
    race_world,
    stay_near_the_centre,
)

ID = "racecraft/DeepRacer-v0"


def test_gymnasium_finds_the_car_by_its_id_and_is_content():
    env = gymnasium.make(ID, width=16, height=12, render_mode="rgb_array")
    check_env(env.unwrapped, skip_render_check=False)
    assert env.observation_space.shape == (12, 16)
    env.reset(seed=1)
    picture = env.render()
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 10
    env.close()


def test_many_cars_come_as_one_vector_environment():
    envs = gymnasium.make_vec(
        ID, num_envs=5, vectorization_mode="vector_entry_point", width=16, height=12, track="Oval_track"
    )
    frames, _ = envs.reset(seed=0)
    assert frames.shape == (5, 12, 16)
    frames, reward, _, _, info = envs.step(np.full(5, 4))
    frames, reward, _, _, info = envs.step(np.full(5, 4))
    assert (reward > 0.5).all(), "cars that have just begun stand on the centre line"
    assert info["active"].all()
    envs.close()


def test_a_frame_is_as_large_as_the_simulators_where_nothing_is_said():
    assert race_world().spec.observations["FRONT_FACING_CAMERA"].shape[:2] == (120, 160)


RANGES = {"steering_angle": (-30, 20), "speed": (0.5, 2.0)}


def test_two_ranges_make_a_car_with_continuous_actions():
    told = []
    env = gymnasium.make(
        ID, width=16, height=12, actions=RANGES,
        reward=lambda params: told.append((params["steering_angle"], params["speed"])) or 1.0,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*symmetric and normalized")  # these are rad and m/s
        check_env(env.unwrapped, skip_render_check=True)
    np.testing.assert_allclose(env.action_space.low, [np.radians(-30), 0.5], rtol=1e-6)
    np.testing.assert_allclose(env.action_space.high, [np.radians(20), 2.0], rtol=1e-6)
    env.reset(seed=1)
    told.clear()
    for action in ((0.0, 1.0), env.action_space.high, env.action_space.low):
        env.step(np.array(action, np.float32))
    assert told == [(20.0, 2.0), (-30.0, 0.5)], "the first action of an episode is not obeyed"
    env.close()


class TestContinuousCar(WorldConformance):
    """A car with continuous actions by its Gymnasium words sits the exam."""

    ticks = 40

    def make_world(self, num_worlds):
        return race_world(num_cars=num_worlds, actions=RANGES, width=16, height=12, max_episode_seconds=1.5)


class TestRaceWorld(WorldConformance):
    """The race world sits the exam; half a second of clock makes it cut and begin episodes."""

    ticks = 60

    def make_world(self, num_worlds):
        return race_world(num_cars=num_worlds, width=16, height=12, max_episode_seconds=1.5)


class TestCarWithSensors(WorldConformance):
    """Two eyes and a LiDAR sit the exam."""

    ticks = 60

    def make_world(self, num_worlds):
        return race_world(
            num_cars=num_worlds, width=16, height=12, max_episode_seconds=1.5,
            sensors=("STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"), lidar_config={"num_sectors": 4},
        )  # fmt: skip


def test_several_sensors_are_a_dictionary_by_their_names():
    env = gymnasium.make("racecraft/DeepRacer-v0", width=16, height=12, sensors=("STEREO_CAMERAS", "LIDAR"))
    seen, _ = env.reset(seed=0)
    assert {name: (part.dtype, part.shape) for name, part in seen.items()} == {
        "STEREO_CAMERAS": (np.uint8, (12, 16, 2)),
        "LIDAR": (np.float32, (64,)),
    }
    assert env.observation_space.contains(seen)
    env.close()


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        ({"actions": []}, "actions is empty; expected at least one"),
        ({"actions": [(30.001, 1.0)]}, r"action 0 is \(30.001, 1.0\); expected -30 to 30 degrees and 0.1 to 4 m/s"),
        ({"actions": {**RANGES, "brake": (0, 1)}}, "expected {"),
        ({"actions": [(0, 1.0), (45, 1.0)]}, r"action 1 is \(45, 1.0\)"),
        ({"actions": {**RANGES, "speed": (2, 2)}}, "each low below its high"),
        ({"actions": {**RANGES, "steering_angle": (-45, 0)}}, r"the low end of actions is \(-45, 0.5\)"),
        ({"actions": {**RANGES, "steering_angle": (-30, 30.1)}}, r"the high end of actions is \(30.1, "),
    ],
)
def test_actions_that_no_car_can_take_are_refused(words, letter):
    with pytest.raises(SettingError, match=letter):
        race_world(width=16, height=12, **words)


def test_a_car_can_take_what_lies_at_its_borders():
    table = race_world(width=16, height=12, actions=[(-30, 0.1), (30, 4.0)]).spec.actions
    assert table.count == 2
    ranges = race_world(width=16, height=12, actions={"steering_angle": (-30, 30), "speed": (0.1, 4)}).spec.actions
    np.testing.assert_allclose([ranges.low, ranges.high], [[-np.pi / 6, 0.1], [np.pi / 6, 4.0]])
    assert race_world(width=16, height=12).spec.actions.count == 10, "the console's ten"


@pytest.mark.parametrize(("aside", "paid"), [(0.0, 1.0), (0.15, 0.5), (0.3, 0.0), (0.45, 0.0)])
def test_by_default_the_share_of_the_half_width_up_to_the_border_is_paid(aside, paid):
    assert stay_near_the_centre({"distance_from_center": aside, "track_width": 0.6}) == pytest.approx(paid)


def test_a_car_is_drawn_for_people_only_where_that_is_asked_for():
    env = DeepRacerEnv(width=16, height=12)
    assert env.render_mode is None
    assert env.render() is None
    assert env.metadata == {"render_modes": ["rgb_array"], "render_fps": 15}
    with pytest.raises(SettingError, match="render_mode is 'human'; expected None or 'rgb_array'"):
        DeepRacerEnv("human")
