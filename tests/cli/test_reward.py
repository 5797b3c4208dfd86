"""`racecraft reward` as a racer uses it: samples, faults, cases, a public log of AWS's, and wrong input."""

import json

import pytest
from tests.reference import TRACES

from racecraft.worlds.deepracer.files.reward_samples import read_sample

LOG = str(TRACES / "drfc-1-worker")


@pytest.fixture
def car(tmp_path):
    (tmp_path / "car").mkdir()

    def written(text, cases=None):
        (tmp_path / "car" / "reward_function.py").write_text(text)
        if cases is not None:
            (tmp_path / "car" / "reward_test.toml").write_text(cases)
        return "car"

    return written


def test_a_check_ends_with_1_where_there_is_a_fault_and_its_page_shows_it(racecraft, car, tmp_path):
    said = racecraft("reward", "check", car("def reward_function(params):\n    return 4.0 - params['speed']\n"),
                     "--page", "reward.html")  # fmt: skip
    assert said.code == 1, said.err
    assert "FAULT car/reward_function.py: the faster the command, the less is paid" in said.out
    assert "the less is paid" in (tmp_path / "reward.html").read_text()
    said = racecraft("reward", "check", car(read_sample("metres_gained")), "--for", "race", "--json")
    assert said.code == 0, said.err
    assert json.loads(said.out)["situations"] == 200


def test_the_centre_line_pays_a_public_log_again_as_aws_paid_it(racecraft, car):
    """All but a few rows, at the edges of the bands, where the log's pose is of another instant than its reward."""
    said = racecraft("reward", "rescore", car(read_sample("centre_line")), LOG, "--json", "--page", "then.html",
                     "--picture", "then.png")  # fmt: skip
    assert said.code == 0, said.err
    facts = json.loads(said.out)
    assert (facts["track"], len(facts["laps"]), facts["failures"]) == ("reinvent_base", 45, [])
    assert facts["agreement"] > 0.9999
    paid = [(one["old"], one["new"]) for one in facts["episodes"]]
    assert abs(sum(old for old, _ in paid) - sum(new for _, new in paid)) < 1e-3 * sum(old for old, _ in paid)


def test_the_lines_of_a_log_are_explained_by_any_reward(racecraft, car):
    said = racecraft("reward", "explain", LOG, "--reward", car(read_sample("calm_centre")) + "/reward_function.py")
    assert said.code == 0, said.err
    assert "`reward` is built up line by line" in said.out
    assert "reward = 1.0" in said.out


def test_rows_are_explained_from_an_episodes_beginning_and_those_that_fail_are_named(racecraft, car):
    text = (
        "class Kept:\n    begun = None\ndef reward_function(params):\n    if params['steps'] <= 2:\n"
        "        Kept.begun = 1.0\n    if params['steps'] == 50:\n        raise ValueError('fifty')\n"
        "    return Kept.begun * 2\n"
    )
    said = racecraft("reward", "explain", LOG, "--reward", car(text) + "/reward_function.py")
    assert said.code == 0, said.err
    assert "line 7: raised ValueError: fifty" in said.out
    assert "TypeError" not in said.out
    assert "rows failed and are counted as 0" in said.out


def test_cases_hold_or_end_with_1(racecraft, car):
    cases = "[[case]]\nname = 'on the line'\npays = {}\n"
    assert racecraft("reward", "test", car(read_sample("constant"), cases.format("1"))).code == 0
    said = racecraft("reward", "test", car(read_sample("constant"), cases.format("2")), "--json")
    assert (said.code, json.loads(said.out)["failed"]) == (1, 1)


def test_a_map_tells_pay_across_the_road_and_what_actions_earn(racecraft, car):
    said = racecraft(
        "reward", "map", car(read_sample("centre_smooth")), "--track", "reinvent_base", "--table", "default"
    )
    assert said.code == 0, said.err
    assert said.out.count("best at") == 10
    said = racecraft("reward", "map", "car", "--track", "reinvent_base", "--term", "shae")
    assert (said.code, "Did you mean 'share'" in said.err) == (2, True)


def test_samples_are_listed_printed_and_begin_a_car(racecraft, tmp_path):
    assert len(json.loads(racecraft("reward", "samples", "--json").out)["samples"]) == 15
    assert racecraft("reward", "samples", "constant").out == read_sample("constant")
    assert racecraft("new", "mine", "--reward", "fast_on_road").code == 0
    assert (tmp_path / "mine" / "reward_function.py").read_text() == read_sample("fast_on_road")
    said = racecraft("new", "other", "--reward", "fast_on_raod")
    assert (said.code, "Did you mean 'fast_on_road'" in said.err) == (2, True)


def test_what_cannot_be_is_refused_by_name(racecraft, car):
    folder = car(read_sample("constant"))
    for arguments, words in (
        (("check", "nowhere.py"), "nowhere.py: there is no such file"),
        (("map", folder, "--track", "reinvent_bse"), "Did you mean 'reinvent_base'"),
        (("test", folder), "reward_test.toml: there is no such file"),
    ):
        said = racecraft("reward", *arguments)
        assert said.code == 2
        assert words in said.err, said.err
