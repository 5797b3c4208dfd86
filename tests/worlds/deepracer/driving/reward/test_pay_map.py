"""The map pays a car at every place; the pull of actions drives each of them."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.driving.action_tables import read_table
from racecraft.worlds.deepracer.driving.reward.pay_map import draw_map, pay_map, pull_of_actions
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.files.reward_samples import read_sample
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TRACK = load_track("reinvent_base")


@pytest.fixture
def payer(tmp_path):
    def opened(name):
        path = tmp_path / "reward_function.py"
        path.write_text(read_sample(name))
        return Payer(open_reward(path))

    return opened


def test_the_centre_is_paid_most_by_the_centre_line_and_both_sides_alike(payer, tmp_path):
    mapped = pay_map(payer("centre_smooth"), TRACK, 2.0)
    lanes = mapped.pay.mean(axis=0)
    assert lanes.argmax() == len(lanes) // 2
    assert np.allclose(lanes, lanes[::-1], rtol=0.2)
    draw_map(mapped, tmp_path / "map.png", "pay")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_a_reward_for_metres_gained_pays_the_metres_of_one_tick_everywhere(payer):
    """2 m/s for 1/15 s, paid twice; the inside of a bend gains more metres of centre line."""
    mapped = pay_map(payer("metres_gained"), TRACK, 2.0)
    middle = mapped.pay[:, mapped.pay.shape[1] // 2]
    assert np.median(middle) == pytest.approx(2.0 * 2.0 / 15.0, rel=0.02)
    assert middle.min() > 0.2


def test_one_term_is_shown_by_itself(payer):
    mapped = pay_map(payer("line_follower"), TRACK, 2.0, term="on_line")
    assert {"on_line", "pace", "off"} <= set(mapped.terms)
    assert np.nanmax(mapped.pay) == pytest.approx(1.0, abs=0.02)
    assert np.nanmin(mapped.pay) == 0.0


def test_actions_pull_towards_what_pays(payer):
    pull = pull_of_actions(payer("fast_on_road"), TRACK, PROFILES["v6"], read_table("7x1.5,2.5"), 1.5)
    best = [one["action"] for one in sorted(pull.as_dictionary()["actions"], key=lambda one: -one["mean_pay"])]
    assert best[0].endswith("2.5 m/s")
    assert "1.5 m/s" in best[-1]
    assert sum(one["best_share"] for one in pull.as_dictionary()["actions"]) == pytest.approx(1.0)
