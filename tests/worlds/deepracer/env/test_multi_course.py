"""Cars on several courses, as one world: the exam, and each course as it is alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError
from racecraft.contract.world import EpisodeRecord, allocate
from racecraft.rollout.episodes import play_episodes
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME, world_spec
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
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


# ---- courses that only note what they are told -----------------------------------------------------------------------


class Noting:
    """A course of some worlds with one car each, which writes down what it is asked and moves nothing."""

    def __init__(self, name, worlds, objects=False, variation=None, paid=True, begun=0):
        camera = CameraConfig(16, 12)
        self.spec = world_spec(ACTIONS, camera, worlds, f"DeepRacer {name}", has_objects=objects)
        self.track, self.variation, self.has_reward = SimpleNamespace(name=name), variation, paid
        self.episodes_started, self.next_start_share, self.habits = begun, 0.25 * begun, f"habits of {name}"
        self.start_shares, self.track_lengths = np.full(worlds, 0.1 * worlds), np.full(worlds, 10.0 * worlds)
        self.reports, self.heard, self.told = np.full((worlds, 1), worlds), [], []

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *told: self.heard.append((name, *told))

    def step(self, actions, buffers):
        self.heard.append(("step", actions.tolist()))
        buffers.reward[:], buffers.terminated[:], buffers.truncated[:] = 5.0, True, True
        buffers.observations[CRITIC_NAME][:] = 7.0
        buffers.final_observations[CRITIC_NAME][:] = 9.0

    def pop_episodes(self):
        told, self.told = self.told, []
        return told

    def save_state(self):
        return {"car.x": self.reports, "a/b": self.reports}


def two(**second):
    courses = Noting("one", 2, begun=1), Noting("two", 3, begun=2, **second)
    return courses, MultiCourseWorld(courses)


def test_a_whole_is_named_and_counted_by_its_courses():
    (one, other), whole = two()
    assert (whole.spec.name, whole.spec.num_worlds, whole.spec.num_agents) == ("DeepRacer one and two", 5, 1)
    assert whole.track is one.track
    assert whole.habits == "habits of one"
    assert (whole.episodes_started, whole.next_start_share) == (3, 0.25)
    assert whole.start_shares == pytest.approx([0.2, 0.2, 0.3, 0.3, 0.3])
    assert whole.track_lengths.tolist() == [20.0, 20.0, 30.0, 30.0, 30.0]
    assert whole.reports[:, 0].tolist() == [2, 2, 3, 3, 3]
    assert whole.has_reward
    assert not two(paid=False)[1].has_reward
    twice = MultiCourseWorld([Noting("one", 1), Noting("one", 1)])
    assert twice.spec.name == "DeepRacer one", "a track is named once"


def test_each_course_is_given_its_rows_and_a_seed_of_its_own():
    """Seeds lie 7919 apart: neither neighbours nor a collector's steps of 1 000 003 meet."""
    (one, other), whole = two()
    buffers = allocate(whole.spec)
    whole.reset(buffers, 3)
    assert [course.heard[-1][::2] for course in (one, other)] == [("reset", 3), ("reset", 3 + 7919)]
    whole.move_starts([0.0, 0.1, 0.2, 0.3, 0.4])
    assert [course.heard[-1][1].tolist() for course in (one, other)] == [[0.0, 0.1], [0.2, 0.3, 0.4]]
    whole.freeze(np.array([[True], [False], [False], [True], [True]]))
    assert [course.heard[-1][1].tolist() for course in (one, other)] == [[[True], [False]], [[False], [True], [True]]]
    whole.begin_episodes(buffers)
    assert [course.heard[-1][0] for course in (one, other)] == ["begin_episodes"] * 2
    with pytest.raises(ContractError, match="4 actions for 5 worlds"):
        whole.step(np.zeros((4, 1)), buffers)


def test_episodes_are_told_by_the_numbers_of_the_whole():
    (one, other), whole = two()
    one.told = [EpisodeRecord(1, 0, 5, 1.0, "a")]
    other.told = [EpisodeRecord(0, 0, 6, 2.0, "b"), EpisodeRecord(2, 0, 7, 3.0, "c")]
    assert [(told.world, told.status) for told in whole.pop_episodes()] == [(1, "a"), (2, "b"), (4, "c")]
    assert whole.pop_episodes() == []


def test_states_are_told_apart_by_the_number_of_their_course():
    (one, other), whole = two()
    state = whole.save_state()
    assert sorted(state) == ["0/a/b", "0/car.x", "1/a/b", "1/car.x"]
    whole.load_state(state, allocate(whole.spec))
    for course in (one, other):
        name, loaded, _ = course.heard[-1]
        assert name == "load_state"
        assert {part: array.tolist() for part, array in loaded.items()} == {
            "car.x": course.reports.tolist(), "a/b": course.reports.tolist()
        }  # fmt: skip


def test_a_course_rests_only_when_all_its_cars_may_and_until_the_next_reset():
    (one, other), whole = two()
    buffers = allocate(whole.spec)
    whole.rest(np.array([[True], [True], [True], [False], [True]]))
    buffers.reward[:], buffers.terminated[:], buffers.truncated[:] = 1.0, True, True
    whole.step(np.arange(5)[:, None], buffers)
    assert (one.heard, other.heard) == ([], [("step", [[2], [3], [4]])])
    assert buffers.reward[:, 0].tolist() == [0, 0, 5, 5, 5]
    assert buffers.terminated[:, 0].tolist() == buffers.truncated[:, 0].tolist() == [False, False, True, True, True]
    whole.reset(buffers, 0)
    whole.step(np.arange(5)[:, None], buffers)
    assert one.heard[-1] == ("step", [[0], [1]])


def test_a_critic_is_told_of_objects_where_any_course_has_them():
    """A course without them writes the numbers that it has; those behind stay 0."""
    for objects in (False, True):
        (one, other), whole = two(objects=objects)
        narrow, wide = one.spec.observations[CRITIC_NAME].shape[0], whole.spec.observations[CRITIC_NAME].shape[0]
        assert wide - narrow == (race.CRITIC_OBJECT_NUMBERS if objects else 0)
        buffers = allocate(whole.spec)
        whole.step(np.zeros((5, 1)), buffers)
        for seen, number in ((buffers.observations, 7.0), (buffers.final_observations, 9.0)):
            assert (seen[CRITIC_NAME][:2, 0, :narrow] == number).all()
            assert not seen[CRITIC_NAME][:2, 0, narrow:].any()
            assert (seen[CRITIC_NAME][2:] == number).all()
    elsewhere = MultiCourseWorld([Noting("one", 1)], has_objects=True)
    assert elsewhere.spec.observations[CRITIC_NAME].shape[0] == race.CRITIC_NUMBERS + race.CRITIC_OBJECT_NUMBERS


def test_what_episodes_drew_is_told_of_all_courses_together():
    assert two()[1].variation is None
    drawn = np.zeros((3, 1), [("gain", "f8"), ("grey_object_0", "f8")])
    drawn["gain"], drawn["grey_object_0"] = 1.5, 80.0
    (one, _), whole = two(variation=drawn)
    assert whole.variation["gain"][:, 0].tolist() == [0, 0, 1.5, 1.5, 1.5]
    one.variation = np.full((2, 1), 2.5, [("gain", "f8")])
    assert whole.variation["gain"][:, 0].tolist() == [2.5, 2.5, 1.5, 1.5, 1.5]
    assert whole.variation["grey_object_0"][:, 0].tolist() == [0, 0, 80, 80, 80]
