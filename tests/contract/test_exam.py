"""The exam examined: honest worlds pass, and each kind of cheat is caught."""

import numpy as np
import pytest
from toy_world import Walk

from racecraft.contract.exam import WorldExam


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
