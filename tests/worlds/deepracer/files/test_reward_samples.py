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
