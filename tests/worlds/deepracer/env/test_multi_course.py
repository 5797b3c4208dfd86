"""Cars on several courses, as one world: the exam, and each course as it is alone."""

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError
from racecraft.contract.world import allocate
from racecraft.rollout.episodes import play_episodes
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(0.5, 1.0), (0.0, 2.0), (-0.5, 1.0)])


def course(track, cars, reverse=False, camera=(16, 12)):
    return RaceWorld(
        load_track(track), ACTIONS, lambda params: params["track_length"], num_cars=cars,
        race_config=RaceConfig(reverse=reverse, max_episode_seconds=3.0), camera_config=CameraConfig(*camera),
    )  # fmt: skip


def three():
    return [course("reinvent_base", 2), course("reinvent_base", 1, reverse=True), course("Oval_track", 2)]


class TestSideBySideSitsTheExam(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return MultiCourseWorld([course("reinvent_base", num_worlds), course("Oval_track", 1, reverse=True)])


def test_each_course_drives_as_it_would_alone():
    """By twin: rows of the whole are the rows of each course by itself, to the bit."""
    whole, alone = MultiCourseWorld(three()), three()
    buffers, own = allocate(whole.spec), [allocate(one.spec) for one in alone]
    whole.reset(buffers, 3)
    for one, theirs in zip(alone, own, strict=True):
        one.reset(theirs, 3)
    rng = np.random.default_rng(0)
    for _ in range(60):
        actions = rng.integers(0, 3, (5, 1))
        whole.step(actions, buffers)
        for one, theirs, rows in zip(alone, own, (slice(0, 2), slice(2, 3), slice(3, 5)), strict=True):
            one.step(actions[rows], theirs)
            for name, seen in theirs.observations.items():
                assert np.array_equal(buffers.observations[name][rows], seen)
            assert np.array_equal(buffers.reward[rows], theirs.reward)
            assert np.array_equal(buffers.truncated[rows], theirs.truncated)
    episodes = whole.pop_episodes()
    assert {record.world for record in episodes} == set(range(5))
    assert len(episodes) == sum(len(one.pop_episodes()) for one in alone)


def test_every_course_is_told_of_its_own_track():
    whole = MultiCourseWorld(three())
    lengths = [load_track(name).as_filed().length for name in ("reinvent_base",) * 3 + ("Oval_track",) * 2]
    assert whole.track_lengths == pytest.approx(lengths)
    buffers = allocate(whole.spec)
    whole.reset(buffers, 0)
    for _ in range(2):
        whole.step(np.ones((5, 1), np.int64), buffers)
    assert buffers.reward[:, 0] == pytest.approx(lengths, rel=1e-6)


def test_cars_that_see_otherwise_cannot_stand_beside_one_another():
    with pytest.raises(ContractError, match="shows or is told something else"):
        MultiCourseWorld([course("reinvent_base", 1), course("reinvent_base", 1, camera=(20, 15))])


class Standing:
    """A policy that chooses straight ahead, by row."""

    def act(self, observations, action_mask=None):
        return np.ones(len(next(iter(observations.values()))), np.int64)

    def reset_state(self, rows):
        pass


def test_a_course_rests_once_its_episodes_are_played_and_the_others_drive_as_beside_it():
    short, long = course("reinvent_base", 2), course("Oval_track", 2, reverse=True)
    taken = {}
    for name, one in (("short", short), ("long", long)):
        step = one.step
        taken[name] = 0

        def counted(actions, buffers, step=step, name=name):
            taken[name] += 1
            step(actions, buffers)

        one.step = counted
    told = play_episodes(Standing(), MultiCourseWorld([short, long]))
    alone = [
        *play_episodes(Standing(), course("reinvent_base", 2)),
        *play_episodes(Standing(), course("Oval_track", 2, True)),
    ]
    assert [(one.steps, one.status) for one in told] == [(one.steps, one.status) for one in alone]
    assert taken == {
        "short": max(one.steps for one in told[:2]),
        "long": max(one.steps for one in told[2:]),
    }
    assert taken["short"] != taken["long"]


def among_boxes():
    """A course among boxes whose episodes vary."""
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, camera_config=CameraConfig(16, 12), variation=VariationConfig("strong"),
        race_config=RaceConfig(type="OBJECT_AVOIDANCE"), objects=BoxesConfig(positions="0.05,1"),
    )  # fmt: skip


def test_a_critic_is_told_of_objects_where_any_course_has_them():
    """A course without them writes the numbers that it has; those behind stay 0."""
    whole = MultiCourseWorld([course("Oval_track", 1), among_boxes()])
    buffers = allocate(whole.spec)
    whole.reset(buffers, 0)
    plain, boxes = buffers.observations[CRITIC_NAME][:, 0]
    assert plain[: race.CRITIC_NUMBERS].any()
    assert not plain[race.CRITIC_NUMBERS :].any()
    assert boxes[race.CRITIC_NUMBERS :].any()


def test_what_episodes_drew_is_told_of_all_courses_together_and_differs_between_them():
    courses = course("Oval_track", 1), among_boxes(), among_boxes()
    whole = MultiCourseWorld(courses)
    buffers = allocate(whole.spec)
    whole.reset(buffers, 0)
    whole.step(np.ones((3, 1), np.int64), buffers)
    plain, *varied = whole.variation["gain"].ravel()
    assert plain == 0.0
    assert varied == [one.variation["gain"].item() for one in courses[1:]]
    assert varied[0] != varied[1]


def test_starts_and_parked_cars_are_those_of_their_own_course():
    courses, shares = three(), [0.0, 0.1, 0.2, 0.3, 0.4]
    whole = MultiCourseWorld(courses)
    buffers = allocate(whole.spec)
    whole.move_starts(shares)
    whole.reset(buffers, 0)
    assert np.concatenate([one.cars["start_share"][:, 0] for one in courses]) == pytest.approx(shares)
    parked = [True, False, False, True, False]
    whole.freeze(np.array(parked)[:, None])
    whole.step(np.ones((5, 1), np.int64), buffers)
    assert (whole.reports["status"][:, 0] == race.PARK).tolist() == parked
