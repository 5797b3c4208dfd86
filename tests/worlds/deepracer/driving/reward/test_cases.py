"""The racer's own expectations: they hold or fail, stop a training, and a wrong file is named."""

import pytest

from racecraft.contract.errors import InputFileError, RewardError, TrackError
from racecraft.worlds.deepracer.driving.reward.cases import CASES, run_cases
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.files.reward_samples import read_sample
from racecraft.worlds.deepracer.training.expectations import require_expectations

CENTRE = """
[[case]]
name = "centre before border"
here = { share = 0.1 }
more_than = { share = 0.1, offset_m = 0.3 }
[[case]]
name = "in the first band"
here = { offset_m = 0.05 }
pays = 1.0
[[case]]
name = "beside the road"
here = { offset_m = -0.7 }
at_most = 0.01
"""


@pytest.fixture(scope="module")
def reward(tmp_path_factory):
    path = tmp_path_factory.mktemp("car") / "reward_function.py"
    path.write_text(read_sample("centre_line"))
    return open_reward(path)


def results(reward, text):
    path = reward.path.with_name(CASES)
    path.write_text(text)
    return run_cases(path, Payer(reward))


def test_cases_hold_and_fail_by_what_is_paid(reward):
    assert [one.passed for one in results(reward, CENTRE)] == [True, True, True]
    turned = CENTRE.replace("more_than", "less_than").replace("pays = 1.0", "pays = 0.9").replace("at_most", "at_least")
    told = results(reward, turned)
    assert [one.passed for one in told] == [False, False, False]
    assert told[1].text == "pays 1; expected exactly 0.9"


def test_a_reward_that_pays_for_what_was_gained_is_asked_with_the_tick_before(tmp_path):
    """A tick at 3 m/s gains 0.2 m, paid twice."""
    path = tmp_path / "reward_function.py"
    path.write_text(read_sample("metres_gained"))
    case = "[[case]]\nname = 'fast'\nhere = { share = 0.03, speed_mps = 3.0 }\nat_least = 0.399\n"
    (fast,) = results(open_reward(path), case)
    assert fast.passed, fast.text


def test_a_case_that_fails_stops_the_training_and_is_named(reward):
    reward.path.with_name(CASES).write_text(CENTRE)
    require_expectations(reward)
    reward.path.with_name(CASES).write_text(CENTRE.replace("pays = 1.0", "pays = 2.0"))
    with pytest.raises(
        RewardError, match="1 of 3 cases do not hold.*\n  in the first band: pays 1; expected exactly 2"
    ):
        require_expectations(reward)
    reward.path.with_name(CASES).unlink()
    require_expectations(reward)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("track = 3 4", "no TOML"),
        ("track = 'reinvent_base'", "no \\[\\[case\\]\\]"),
        ("[[case]]\npays = 1\nat_most = 2", "2 expectations"),
        ("[[case]]\nhere = { ofset_m = 1 }\npays = 1", "Did you mean 'offset_m'"),
        ("[[case]]\nhere = { share = true }\npays = 1", "a number"),
        ("[[case]]\nmore_than = 1", "a table"),
    ],
)
def test_a_wrong_file_is_named_with_what_is_expected(reward, text, said):
    with pytest.raises(InputFileError, match=said):
        results(reward, text)


def test_an_unknown_track_is_named(reward):
    with pytest.raises(TrackError):
        results(reward, "track = 'reinvent_bas'\n" + CENTRE)
