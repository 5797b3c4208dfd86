"""What a policy chooses, and what a car is told."""

import math

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.contract.world import ContinuousActions, DiscreteActions, allocate
from racecraft.worlds.deepracer.env.actions import (
    NO_NUMBER,
    ActionBox,
    ActionTable,
    OwnActions,
    action_label,
    action_space,
)
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import ActionRanges, CarAction
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TABLE = ActionTable.of([(math.radians(-45), 0.05), (0.0, 1.0), (math.radians(15), 5.0)])
BOX = ActionBox((math.radians(-30), math.radians(25)), (0.5, 5.0))


def test_a_choice_is_told_as_written_and_sent_as_the_original_sends_it():
    """±30 degrees, 0.1 to 4 m/s (facts 1.2)."""
    told = TABLE.commands(np.array([[0, 1], [2, 2]]))
    assert told.chosen.shape == told.sent.shape == (2, 2, 2)
    np.testing.assert_allclose(np.degrees(told.chosen[..., 0]), [[-45, 0], [15, 15]])
    np.testing.assert_allclose(np.degrees(told.sent[..., 0]), [[-30, 0], [15, 15]])
    np.testing.assert_array_equal(told.chosen[..., 1], [[0.05, 1], [5, 5]])
    np.testing.assert_array_equal(told.sent[..., 1], [[0.1, 1], [4, 4]])
    np.testing.assert_array_equal(told.numbers, [[0, 1], [2, 2]])


def test_a_continuous_action_is_its_own_command():
    told = BOX.commands(np.array([[[0.1, 1.25]], [[-0.2, 4.5]]], np.float32))
    np.testing.assert_array_equal(told.chosen, np.array([[[0.1, 1.25]], [[-0.2, 4.5]]], np.float32).astype(float))
    np.testing.assert_array_equal(told.sent[..., 1], [[1.25], [4.0]])
    assert (told.numbers == NO_NUMBER).all()


def test_an_end_of_a_range_is_met_to_the_last_digit_and_never_passed():
    """25 degrees are no float32; a reward function that compares with 25 must find them."""
    low, high = (np.array(end, np.float32) for end in (BOX.spec.low, BOX.spec.high))
    for ends, beyond in ((BOX.spec.low, low - 1), (BOX.spec.high, high + 1)):
        exactly = np.array(ends, np.float32)
        inwards = np.nextafter(exactly, np.array(0.5 * (low + high), np.float32))
        for told in (exactly, inwards, beyond):
            assert tuple(BOX.commands(told[None, None]).chosen[0, 0]) == ends


def test_specs_are_in_rad_and_metres_a_second():
    assert TABLE.spec == DiscreteActions(3, ("right 45° at 0.05 m/s", "straight at 1 m/s", "left 15° at 5 m/s"))
    assert BOX.spec == ContinuousActions((math.radians(-30), 0.5), (math.radians(25), 5.0))
    assert BOX.spec.shape == (2,)


def test_a_file_s_action_space_becomes_a_table_or_a_box():
    assert action_space([CarAction(0.1, 1.0), CarAction(-0.1, 2.0)]) == ActionTable((0.1, -0.1), (1.0, 2.0))
    assert action_space(ActionRanges(-0.5, 0.4, 1.0, 2.0)) == ActionBox((-0.5, 0.4), (1.0, 2.0))


@pytest.mark.parametrize("wrong", [-1, 3])
def test_a_choice_that_the_table_lacks_is_refused(wrong):
    with pytest.raises(ContractError, match="are not from 0 to 2"):
        TABLE.commands(np.array([[1, wrong]]))


def test_a_command_that_is_no_number_is_refused():
    with pytest.raises(ContractError, match="not all finite"):
        BOX.commands(np.array([[[0.0, math.nan]]], np.float32))


def test_the_same_commands_drive_the_same_whichever_way_they_were_chosen():
    """By twin: quarters of a rad and of a metre a second, which single precision holds exactly."""
    pairs = [(-0.25, 0.5), (0.0, 1.0), (0.25, 1.5), (0.5, 2.0)]
    choices = np.random.default_rng(1).integers(0, 4, (80, 3, 1))
    heard, stories = [], []
    for actions in (ActionTable.of(pairs), ActionBox((-0.5, 0.5), (0.5, 4.0))):
        told = []
        world = RaceWorld(
            load_track("Oval_track"),
            actions,
            lambda params, told=told: told.append((params["steering_angle"], params["speed"])) or params["progress"],
            camera_config=CameraConfig(16, 12),
            num_cars=3,
        )
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        story = []
        for row in choices:
            world.step(row if isinstance(actions, ActionTable) else np.array(pairs, np.float32)[row], buffers)
            assert (world.reports["action"] == (row if isinstance(actions, ActionTable) else NO_NUMBER)).all()
            story.append([world.reports[name].tobytes() for name in ("x", "y", "yaw", "speed", "steering", "status")])
            story.append(buffers.reward.tobytes())
        heard.append(told)
        stories.append(story)
    assert stories[0] == stories[1]
    assert heard[0] == heard[1]


def test_actions_of_another_shape_are_refused_with_the_one_expected():
    world = RaceWorld(load_track("Oval_track"), BOX, camera_config=CameraConfig(16, 12), num_cars=3, cars_per_world=2)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    with pytest.raises(ContractError, match=r"expected shape \(3, 2, 2\)"):
        world.step(np.zeros((3, 2)), buffers)


# ---- cars of which each has its own ----------------------------------------------------------------------------------


def test_each_car_is_told_by_its_own_action_space():
    """Two worlds of two cars: the table's choices stand in the first number, a pair within ranges is a pair."""
    own = OwnActions((TABLE, BOX), np.array([[0, 1], [1, 0]]))
    assert own.spec == ContinuousActions((-math.inf, -math.inf), (math.inf, math.inf))
    told = own.commands(np.array([[[2, 0], [0.25, 9.0]], [[-9.0, 1.5], [0, 0]]]))
    np.testing.assert_allclose(np.degrees(told.chosen[..., 0]), [[15, math.degrees(0.25)], [-30, -45]])
    assert told.chosen[..., 1].tolist() == [[5.0, 5.0], [1.5, 0.05]]
    np.testing.assert_allclose(np.degrees(told.sent[..., 0]), [[15, math.degrees(0.25)], [-30, -30]])
    assert told.sent[..., 1].tolist() == [[4.0, 4.0], [1.5, 0.1]]
    assert told.numbers.tolist() == [[2, -1], [-1, 0]]
    assert told.numbers.dtype == np.int64
    with pytest.raises(ContractError, match="are not from 0 to 2"):
        own.commands(np.array([[[3, 0], [0, 1]], [[0, 1], [0, 0]]]))


@pytest.mark.parametrize(
    ("degrees", "speed", "words"),
    [
        (-30.0, 4.0, "right 30° at 4 m/s"), (0.0004, 1.0, "straight at 1 m/s"), (12.3456, 1.0, "left 12.346° at 1 m/s"),
    ],
)  # fmt: skip
def test_an_action_is_told_in_a_racers_words(degrees, speed, words):
    assert action_label(math.radians(degrees), speed) == words
