"""Samples: fifteen, each with a line that says what it pays for, and each pays every example situation."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.files.reward_file import load_reward_function, validate
from racecraft.worlds.deepracer.files.reward_samples import FOLDER, describe_sample, read_sample, sample_names


def test_there_are_fifteen_the_three_of_the_source_course_among_them():
    assert len(sample_names()) == 15
    assert {"inside_borders", "centre_line", "constant", "line_follower"} <= set(sample_names())


@pytest.mark.parametrize("name", sample_names())
def test_a_sample_says_what_it_pays_for_and_pays(name):
    assert describe_sample(name).startswith(("Pay", "Take"))
    assert set(validate(load_reward_function(FOLDER / f"{name}.py")))


def test_an_unknown_sample_is_named_with_the_nearest():
    with pytest.raises(SettingError, match="Did you mean 'centre_line'"):
        read_sample("center_line")


def test_small_corrections_to_the_other_side_cost_what_their_angle_does_and_swerves_cost_more():
    def pay(*angles):
        names = {}
        exec(read_sample("metres_gained"), names)
        ticks = [
            {"steps": k + 1, "progress": k + 1.0, "steering_angle": angle, "track_length": 20.0, "is_offtrack": False}
            for k, angle in enumerate(angles)
        ]
        return sum(names["reward_function"](tick) for tick in ticks)

    assert pay(4.0, -4.0, 4.0) == pytest.approx(pay(2.0, 10.0, 2.0))
    assert pay(9.0, 0.0, -9.0) < pay(9.0, 0.0, 9.0) - 0.1
