"""The page of a reward shows its remarks in their lines, tricks, speed, the map and old laps, in one file."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.analysis.reward_page import reward_data, write_reward_page
from racecraft.worlds.deepracer.driving.reward.check import check_reward
from racecraft.worlds.deepracer.driving.reward.pay_map import pay_map
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.rescore import Episode, Rescored
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TEXT = """\
def reward_function(params):
    if params["progress"] == 1:
        return "<b>late</b>"
    return 5.0 - params["speed"]
"""


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    path = tmp_path_factory.mktemp("car") / "reward_function.py"
    path.write_text(TEXT)
    mapped = pay_map(Payer(open_reward(path)), load_track("reinvent_base"), 2.0)
    laps = (
        Episode(0, 1, "training", True, 9.0, 100.0, 50.0, 3.0),
        Episode(1, 1, "training", True, 8.0, 100.0, 40.0, 4.0),
    )
    rescored = Rescored(load_track("reinvent_base"), laps, np.zeros(2), ())
    return check_reward(path), mapped, rescored


def test_remarks_stand_in_their_lines_and_the_worst_comes_first(parts):
    told = reward_data(*parts)["check"]
    assert [line["kind"] for line in told["lines"]] == ["", "bad", "warn", ""]
    assert told["sentence"].startswith("Line 2: ")
    assert {"bad", "warn"} == {one["kind"] for one in told["findings"]}
    answers = {one["name"]: one["answer"] for one in told["tricks"]}
    assert answers["Creeping"] == "more"


def test_every_place_of_the_map_is_drawn_once_in_the_colour_of_its_pay(parts):
    told = reward_data(None, parts[1])["map"]
    assert sum(path.count("M") for _, path in told["cells"]) == parts[1].pay.size
    assert told["low"] == told["high"] == "3"


def test_laps_stand_with_both_places(parts):
    told = reward_data(rescored=parts[2])["rescored"]
    assert told["rows"] == [("1", "8.00", "40", "4", "2", "1"), ("0", "9.00", "50", "3", "1", "2")]


def test_the_page_is_one_file_and_a_racers_text_is_no_markup(parts, tmp_path):
    write_reward_page(tmp_path / "reward.html", "mine", *parts)
    page = (tmp_path / "reward.html").read_text()
    assert "<b>late</b>" not in page
    assert "&lt;b&gt;late&lt;/b&gt;" in page
    assert "What would pay more than lapping?" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
