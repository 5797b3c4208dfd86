"""With fidelity aws chance has a hand in every try of an evaluation, each time another, and the same again tomorrow."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.evaluator import CarEvaluator


class StraightOn:
    """Drives straight until the road is left."""

    def act(self, observations, action_mask=None):
        return np.zeros(len(next(iter(observations.values()))), np.int64)

    def reset_state(self, rows): ...


def tries(fidelity):
    """The ticks at which tries end, and the last place of each, of three tries from the same start."""
    race = RaceConfig(fidelity=fidelity)
    small = CameraConfig(width=16, height=12)
    world = RaceWorld(
        load_track("reinvent_base"), ActionTable.of([(0.0, 1.0)]), race_config=race, camera_config=small,
        start_shares=[0.0], laps=3,
    )  # fmt: skip
    ends = []

    def note(world, buffers, actions):
        report = world.reports[0, 0]
        if report["terminated"] or report["truncated"]:
            ends.append((round(float(report["x"]), 9), round(float(report["y"]), 9)))

    report = judge_laps(StraightOn(), world, 3, [note])
    assert report.full_laps == 0
    assert len(ends) == 3
    return ends


def test_every_try_draws_anew_where_chance_has_a_hand_and_an_evaluation_repeats_itself():
    assert len(set(tries("aws"))) == 3
    assert tries("aws") == tries("aws")
    assert len(set(tries("sane"))) == 1


class Lapper(StraightOn):
    """Keeps to the road by a plain rule for so many ticks, then steers hard left whatever it sees."""

    def __init__(self, ticks):
        self.ticks = ticks

    def act(self, observations, action_mask=None):
        self.ticks -= 1
        told = observations[CRITIC_NAME]
        wanted = told[..., 7] - 0.5 * told[..., 0]
        return np.where(wanted > 0.1, 2, np.where(wanted < -0.1, 0, 1)) if self.ticks >= 0 else np.full(len(told), 2)


@pytest.mark.parametrize(("ticks", "stable"), [(10_000, True), (500, False)])
def test_stable_is_who_drives_three_laps_one_after_the_other(ticks, stable):
    """A lap at 1 m/s is about 270 ticks: 500 are one lap and most of a second."""
    world = RaceWorld(
        load_track("reinvent_base"), ActionTable.of([(-0.35, 1.0), (0.0, 1.0), (0.35, 1.0)]),
        camera_config=CameraConfig(width=16, height=12), start_shares=[0.0], laps=3,
    )  # fmt: skip
    assert judge_laps(Lapper(300), world, 3).full_laps == 1
    assert CarEvaluator(world, Lapper(ticks), flying=[world]).confirm() is stable
