"""Why it fails: a driver that steers wrong at one known place is found there, with the right cure."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.world import ArraySpec
from racecraft.worlds.deepracer.analysis import comparing
from racecraft.worlds.deepracer.analysis.explaining import explain_failures
from racecraft.worlds.deepracer.analysis.failure_places import facts, sentences
from racecraft.worlds.deepracer.analysis.forgetting import (
    SegmentPassRates,
    StartComparison,
    passages_words,
    starts_words,
)
from racecraft.worlds.deepracer.analysis.why_page import write_why_page
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.env.camera import MOUNT_V3
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TRACK = load_track("reinvent_base")
TABLE = ActionTable.of([(math.radians(angle), 1.0) for angle in (30, 15, 0, -15, -30)])
WRONG_M = (2.0, 2.5)
"""On the first straight it steers hard left there, whatever it sees."""
REWARD = """\
def reward_function(params):
    middle = 1.0 - params["distance_from_center"] / params["track_width"]
    reward = middle
    if not params["all_wheels_on_track"]:
        reward *= 0.25
    return float(reward)
"""


class WrongAtOnePlace:
    """Follows the middle of the road by the true state, but for one place."""

    spec = SimpleNamespace(stack_size=1, network={}, visible={CRITIC_NAME: ArraySpec((17,), np.float32)})

    def __init__(self, actions, wrong=WRONG_M):
        self.actions, self.wrong, self.world = actions, wrong, None

    def act(self, observations, action_mask=None):
        seen = observations[CRITIC_NAME]
        steering = np.clip(0.5 * seen[:, 7] - 0.4 * seen[:, 0], -0.5, 0.5)
        arc = self.world.cars["arc"][:, 0]
        steering = np.where((arc >= self.wrong[0]) & (arc < self.wrong[1]), math.radians(30), steering)
        if isinstance(self.actions, ActionBox):
            return np.column_stack([steering, np.ones(len(steering))]).astype(np.float32)
        return np.abs(np.array(TABLE.steering) - steering[:, None]).argmin(axis=1)

    def reset_state(self, rows): ...


class Car:
    """What `explain_failures` asks of a trained car."""

    trained_on, mount, checkpoint = TRACK, MOUNT_V3, SimpleNamespace(iteration=7)

    def __init__(self, folder, actions=TABLE, wrong=WRONG_M):
        self.actions, self.policy = actions, WrongAtOnePlace(actions, wrong)
        self.run = SimpleNamespace(reward_function=folder / "reward_function.py", episodes=folder / "episodes")
        self.run.reward_function.write_text(REWARD)

    def world(self, track, num_cars, start_shares=None, laps=1):
        self.policy.world = RaceWorld(
            track, self.actions, num_cars=num_cars, start_shares=start_shares, laps=laps,
            race_config=RaceConfig(max_episode_seconds=40.0), camera_config=CameraConfig(width=8, height=6),
        )  # fmt: skip
        return self.policy.world


@pytest.fixture(scope="module")
def why(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return explain_failures(Car(folder), TRACK, "runs/a", starts=6)


def test_the_place_is_found(why):
    assert (why.starts, why.full, why.failures) == (6, 0, 6)
    (place,) = why.places
    assert place.failures == place.reached == 6
    assert WRONG_M[0] < place.arc_m < WRONG_M[1] + 1.0
    assert place.segment == "straight after turn 5"
    first, last = place.waypoints
    assert TRACK.arc[first] > WRONG_M[0] - 0.2
    assert TRACK.arc[last] < WRONG_M[1] + 1.2
    assert place.how == {"off_track": 6}


def test_the_cure_is_not_to_turn_there(why):
    (place,) = why.places
    best = place.cures[0]
    assert best.tried == 6
    assert best.saved >= 4
    assert best.instead_of == "left 30° at 1 m/s"
    assert best.action in ("straight at 1 m/s", "right 15° at 1 m/s", "right 30° at 1 m/s")
    assert WRONG_M[0] - 0.1 <= TRACK.arc[best.waypoint] <= WRONG_M[1] + 0.1
    assert all(hint.saved < best.saved for hint in place.cures if hint.action.startswith("left"))
    assert place.last_chance is not None
    assert f"saves {best.saved} of 6" in best.description


def test_the_last_second_is_told(why):
    before = why.places[0].before
    assert before.seconds[0] == pytest.approx(1.0)
    assert before.seconds[-1] == 0.0
    assert before.frames.shape == (len(before.seconds), 120, 160, 3)
    assert before.frames.std() > 10.0
    assert "left 30° at 1 m/s" in before.actions
    assert before.centre_share[-1] > 1.0


def test_the_reward_is_told_line_by_line(why):
    before = why.places[0].before
    lines = {(line.line, line.name): line.values for line in before.lines}
    assert set(lines) == {(2, "middle"), (3, "reward"), (5, "reward")}
    on_road = np.isnan(lines[5, "reward"])
    assert on_road[0]
    assert not on_road[-1]
    np.testing.assert_allclose(before.rewards[on_road], lines[2, "middle"][on_road])
    np.testing.assert_allclose(before.rewards[~on_road], 0.25 * lines[2, "middle"][~on_road])
    np.testing.assert_allclose(lines[2, "middle"], 1.0 - before.centre_share / 2.0, atol=1e-9)


def test_a_reward_that_cannot_be_loaded_is_said_and_the_rest_is_told(tmp_path):
    car = Car(tmp_path)
    car.run.reward_function.write_text("def reward_function(params):\n    return params['no such thing']\n")
    why = explain_failures(car, TRACK, "a", starts=1)
    assert why.places[0].cures
    assert why.places[0].before.rewards is None
    assert "no such thing" in why.reward_note
    assert "no such thing" in write_why_page(tmp_path / "why.html", why, "a").read_text()


def test_numbers_are_cured_as_choices_are(tmp_path):
    why = explain_failures(Car(tmp_path, ActionBox((-math.radians(30), math.radians(30)), (1.0, 2.0))), TRACK, "a", 3)
    (place,) = why.places
    assert place.cures[0].saved == 3
    assert not place.cures[0].action.startswith("left")


def test_who_does_not_fail_is_told_so(tmp_path):
    why = explain_failures(Car(tmp_path, wrong=(-2.0, -1.0)), TRACK, "a", 2)
    assert (why.full, why.failures, why.places) == (2, 0, [])
    assert "nothing failed" in sentences(why)[0]
    assert "nothing failed" in write_why_page(tmp_path / "why.html", why, "a").read_text()


def test_the_page_stands_alone(why, tmp_path):
    text = write_why_page(tmp_path / "why.html", why, "a & b").read_text()
    assert "a &amp; b" in text
    assert "http" not in text.replace("http://www.w3.org", "")
    assert why.places[0].cures[0].description[3:] in text
    assert "reward *= 0.25" in text
    assert facts(why)["places"][0]["cures"][0]["saved"] >= 4


def test_what_was_known_and_is_lost_is_called_forgotten():
    reached = np.array([[8, 8, 8], [8, 8, 8], [8, 3, 3]])
    passed = np.array([[2, 8, 3], [8, 8, 8], [8, 0, 0]])
    told = SegmentPassRates("runs/a", [0, 10, 20], ["the straight", "turn 1 (left)", "turn 2 (right)"], reached, passed)
    assert told.forgotten == [(0, 1, 2)]
    assert np.isnan(told.share[2, 1])
    lost, what_to_do = passages_words(told)
    assert lost.startswith("The car knew the straight and forgot it: at iteration 10 100 % got through")
    assert what_to_do == (
        "Go on from what knew the way, in smaller steps: racecraft train --from runs/a:10 --set ppo.learning_rate=1e-4"
    )


@pytest.mark.parametrize(("paid", "is_blamed"), [((5.0, 100.0, 231.0), True), ((5.0, 231.0, 100.0), False)])
def test_a_reward_that_rises_while_a_place_is_forgotten_is_blamed(paid, is_blamed):
    reached = np.full((1, 3), 8)
    told = SegmentPassRates(
        "a", [0, 1, 2], ["1"], reached, np.array([[0, 8, 1]]), paid, "racecraft train fast --track Oval"
    )
    what_to_do = passages_words(told)[-1]
    assert ("rose from 100 to 231" in what_to_do) is is_blamed
    assert "racecraft train fast --track Oval --from a:1 " in what_to_do


@pytest.mark.parametrize(("between_full", "over"), [(2, True), (6, False), (8, False)])
def test_over_fitting_is_told_from_chance(between_full, over):
    told = StartComparison(8, 0.5, 8, 8, 8, between_full, 100.0, 50.0)
    assert told.is_over_fitted is over
    assert ("knows its starts" in starts_words(told)) is over


def test_a_car_that_makes_no_lap_anywhere_is_not_said_to_know_the_track():
    told = starts_words(StartComparison(8, 0.5, 8, 0, 8, 0, 30.0, 20.0))
    assert "either" in told
    assert "does not hang" not in told


ONE_START = Path(__file__).with_name("one_start")


def test_a_real_car_that_was_always_started_at_one_place_is_found_out():
    """Its folder's README tells how it was trained."""
    told = comparing.compare_starts(load_trained_car(ONE_START, "last"), most=60)
    assert (told.trained_starts, told.trained, told.between) == (1, 60, 60)
    assert told.trained_full - told.between_full >= 8
    assert told.is_over_fitted
    assert "It knows its starts, not the track: start from more places" in starts_words(told)
