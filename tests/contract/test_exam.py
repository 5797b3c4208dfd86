"""The exam examined: honest worlds pass, and each kind of cheat is caught."""

import numpy as np
import pytest
from toy_world import Walk

from racecraft.contract.exam import WorldExam, legal_actions
from racecraft.contract.world import ContinuousActions, MultiDiscreteActions


class TestWalk(WorldExam):
    def make_world(self, num_worlds):
        return Walk(num_worlds)


class TestMaskedWalkers(WorldExam):
    def make_world(self, num_worlds):
        return Walk(num_worlds, num_agents=2, masked=True)


class TestWalkByHandle(WorldExam):
    def make_world(self, num_worlds):
        return Walk(num_worlds, continuous=True)


def examine(make, name):
    class Sitting(WorldExam):
        def make_world(self, num_worlds):
            return make(num_worlds)

    getattr(Sitting(), name)()


class Forgetful(Walk):
    """Begins wherever it was."""

    def reset(self, buffers, seed):
        before = self.episode.copy()
        super().reset(buffers, seed)
        self.episode[:] = before + 1


class Outside(Walk):
    """Shows a 2 where 1 is the most."""

    def _show(self, named, rows=True):
        super()._show(named, rows)
        named["square"] *= 2


class Silent(Walk):
    """Keeps its last observation to itself."""

    def _show(self, named, rows=True):
        if rows is True:
            super()._show(named, rows)


class Neighbourly(Walk):
    """Worlds depend on how many there are."""

    def reset(self, buffers, seed):
        super().reset(buffers, seed + self.spec.num_worlds)


class Leaky(Walk):
    """Saves its clock as it is, not a copy."""

    def save_state(self):
        return super().save_state() | {"clock": self.clock}

    def step(self, actions, buffers):
        clock = self.clock
        super().step(actions, buffers)
        clock[:] = self.clock
        self.clock = clock


class Amnesiac(Walk):
    """Loads its square and forgets its clock."""

    def load_state(self, state, buffers):
        super().load_state(state | {"clock": state["clock"] * 0}, buffers)


class Hoarder(Walk):
    """Hands out new arrays."""

    def step(self, actions, buffers):
        super().step(actions, buffers)
        buffers.reward = buffers.reward.copy()


@pytest.mark.parametrize(
    ("cheat", "question"),
    [
        (Forgetful, "test_the_same_seed_tells_the_same_story"),
        (Outside, "test_observations_stay_inside_their_spec"),
        (Silent, "test_an_ending_shows_its_own_last_observation"),
        (Neighbourly, "test_stepping_many_worlds_equals_stepping_each_beside_fewer"),
        (Leaky, "test_a_saved_world_goes_on_as_if_nothing_had_happened"),
        (Amnesiac, "test_a_saved_world_goes_on_as_if_nothing_had_happened"),
        (Hoarder, "test_a_world_writes_into_the_arrays_it_is_given"),
    ],
)
def test_a_cheat_is_caught(cheat, question):
    try:
        examine(Walk, question)
        with pytest.raises(AssertionError):
            examine(cheat, question)
    except pytest.skip.Exception as skipped:  # a question that is passed over catches nobody, and would not be seen
        pytest.fail(f"the exam did not ask: {skipped}")


def test_the_exam_says_what_it_could_not_reach():
    class Endless(Walk):
        def step(self, actions, buffers):
            super().step(np.full_like(actions, 2), buffers)
            buffers.terminated[:] = buffers.truncated[:] = False

    with pytest.raises(pytest.skip.Exception, match="no episode ended"):
        examine(Endless, "test_an_ending_shows_its_own_last_observation")


class Strict(Walk):
    """Cannot be stepped before it was begun, as a Gymnasium environment cannot; counts who is open."""

    opened = []

    def __init__(self, *words, **more):
        super().__init__(*words, **more)
        self.begun = False
        self.opened.append(self)

    def reset(self, buffers, seed):
        self.begun = True
        super().reset(buffers, seed)

    def load_state(self, state, buffers):
        self.begun = True
        super().load_state(state, buffers)

    def step(self, actions, buffers):
        assert self.begun, "stepped before it was begun"
        super().step(actions, buffers)


@pytest.mark.parametrize("question", [name for name in vars(WorldExam) if name.startswith("test_")])
def test_every_question_begins_its_worlds_and_closes_them(question):
    Strict.opened.clear()
    examine(Strict, question)
    assert Strict.opened
    assert all(world.closed for world in Strict.opened)
    assert all(world.begun for world in Strict.opened) or question == "test_the_spec_is_whole"


def test_numbers_without_bounds_are_drawn_from_a_thousand_on_either_side():
    unbounded = ContinuousActions((-np.inf, -2.0), (np.inf, 3.0))
    drawn = legal_actions(unbounded, (500, 4), None, np.random.default_rng(0))
    assert drawn.shape == (500, 4, 2)
    assert 990 < drawn[..., 0].max() <= 1000
    assert -1000 <= drawn[..., 0].min() < -990
    assert -2 <= drawn[..., 1].min() < -1.9
    assert 2.9 < drawn[..., 1].max() <= 3


def test_of_several_choices_each_is_one_that_its_own_mask_allows():
    mask = np.zeros((50, 2, 6), bool)
    mask[..., [1, 2, 5]] = True  # of two the second, of four the first and the last
    drawn = legal_actions(MultiDiscreteActions((2, 4)), (50, 2), mask, np.random.default_rng(0))
    assert drawn.shape == (50, 2, 2)
    assert (drawn[..., 0] == 1).all()
    assert set(drawn[..., 1].ravel().tolist()) == {0, 3}
