"""The exam examined: honest worlds pass, and each kind of cheat is caught."""

from dataclasses import replace

import numpy as np
import pytest
from toy_world import Walk

from racecraft.contract.conformance import WorldConformance, legal_actions
from racecraft.contract.world import (
    POLICY_ID,
    AgentGroup,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    EpisodeRecord,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
    allocate,
)


class TestWalk(WorldConformance):
    def make_world(self, num_worlds):
        return Walk(num_worlds)


class TestMaskedWalkers(WorldConformance):
    def make_world(self, num_worlds):
        return Walk(num_worlds, num_agents=2, masked=True)


class TestWalkByHandle(WorldConformance):
    def make_world(self, num_worlds):
        return Walk(num_worlds, continuous=True)


def examine(make, name):
    class Sitting(WorldConformance):
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


class NullCallback(Walk):
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


class Talkative(Walk):
    """Tells of its episodes, and after a reset of those before it."""

    def __init__(self, *words, **more):
        super().__init__(*words, **more)
        self.finished = []

    def step(self, actions, buffers):
        super().step(actions, buffers)
        self.finished += [EpisodeRecord(int(n), int(m), 1, 0.0, "over") for n, m in np.argwhere(buffers.ended)]

    def pop_episodes(self):
        told, self.finished = self.finished, []
        return told


class Discreet(Talkative):
    """Forgets them, as it should."""

    def reset(self, buffers, seed):
        super().reset(buffers, seed)
        self.finished.clear()


@pytest.mark.parametrize(
    ("cheat", "question"),
    [
        (Forgetful, "test_the_same_seed_tells_the_same_story"),
        (Outside, "test_observations_stay_inside_their_spec"),
        (NullCallback, "test_an_ending_shows_its_own_last_observation"),
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


def test_a_world_that_tells_of_episodes_before_a_reset_is_caught():
    question = "test_a_reset_forgets_the_episodes_before_it"
    examine(Discreet, question)
    with pytest.raises(AssertionError, match="episodes from before the reset"):
        examine(Talkative, question)


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


@pytest.mark.parametrize("question", [name for name in vars(WorldConformance) if name.startswith("test_")])
def test_every_question_begins_its_worlds_and_closes_them(question):
    Strict.opened.clear()
    examine(Strict, question)
    assert Strict.opened
    assert all(world.closed for world in Strict.opened)
    assert all(world.begun for world in Strict.opened) or question == "test_the_spec_is_whole"


def test_of_several_choices_each_is_one_that_its_own_mask_allows():
    mask = np.zeros((50, 2, 6), bool)
    mask[..., [1, 2, 5]] = True  # of two the second, of four the first and the last
    drawn = legal_actions(MultiDiscreteActions((2, 4)), (50, 2), mask, np.random.default_rng(0))
    assert drawn.shape == (50, 2, 2)
    assert (drawn[..., 0] == 1).all()
    assert set(drawn[..., 1].ravel().tolist()) == {0, 3}


def test_numbers_and_choices_at_once_are_drawn_side_by_side():
    both = HybridActions(ContinuousActions((-1.0, 2.0), (0.0, 3.0)), MultiDiscreteActions((2, 3)))
    mask = np.zeros((80, 1, 5), bool)
    mask[..., [0, 3, 4]] = True
    drawn = legal_actions(both, (80, 1), mask, np.random.default_rng(0))
    assert (drawn.shape, drawn.dtype) == ((80, 1, 4), np.float32)
    assert (drawn[..., 0] <= 0).all()
    assert (drawn[..., 0] < -0.9).any()
    assert ((drawn[..., 1] >= 2) & (drawn[..., 1] <= 3)).all()
    assert (drawn[..., 2] == 0).all()
    assert set(drawn[..., 3].ravel().tolist()) == {1.0, 2.0}


def test_agents_of_several_kinds_act_each_as_their_own_group_does():
    """Rows lie side by side: a choice of three in the first number, or two numbers; the mask's first columns count."""
    groups = {
        "choosing": AgentGroup({}, DiscreteActions(3), has_action_mask=True),
        "steering": AgentGroup({}, ContinuousActions((5.0, -9.0), (6.0, -8.0))),
        "free": AgentGroup({}, DiscreteActions(2)),
    }
    seen = {POLICY_ID: ArraySpec((), np.int64)}
    spec = WorldSpec("kinds", 50, 3, seen, GroupedActions(2), has_action_mask=True, groups=groups)
    buffers = allocate(spec)
    buffers.observations[POLICY_ID][:] = [0, 1, 2]
    buffers.action_mask[..., :2] = False
    drawn = WorldConformance().choose(spec, buffers, np.random.default_rng(0))
    assert (drawn.shape, drawn.dtype) == ((50, 3, 2), np.float32)
    assert (drawn[:, 0] == [2.0, 0.0]).all()
    assert ((drawn[:, 1] >= [5.0, -9.0]) & (drawn[:, 1] <= [6.0, -8.0])).all()
    assert set(drawn[:, 2, 0].tolist()) == {0.0, 1.0}, "whoever has no mask is bound by none"
    assert not drawn[:, 2, 1].any()


@pytest.mark.parametrize("num_worlds", [2, 1])
def test_worlds_of_a_number_of_their_own_are_not_told_beside_fewer(num_worlds):
    with pytest.raises(pytest.skip.Exception, match="the number of worlds cannot be chosen"):
        examine(lambda asked: Walk(num_worlds), "test_stepping_many_worlds_equals_stepping_each_beside_fewer")


class Garbage(Walk):
    """Writes whatever lies about where nobody looks: the last observation of a story that is over."""

    told = 0

    def step(self, actions, buffers):
        super().step(actions, buffers)
        over = buffers.terminated & ~buffers.truncated
        Garbage.told += 1
        buffers.final_observations["square"][over] = (Garbage.told % 7) / 7
        for rows in buffers.final_observations.values():
            rows[~buffers.ended] = Garbage.told % 5


def test_what_lies_in_rows_that_nobody_reads_belongs_to_no_story():
    for question in (
        "test_the_same_seed_tells_the_same_story",
        "test_stepping_many_worlds_equals_stepping_each_beside_fewer",
        "test_a_saved_world_goes_on_as_if_nothing_had_happened",
    ):
        examine(Garbage, question)


class Cornered(Walk):
    """Leaves a walker on the second square no choice."""

    def __init__(self, num_worlds):
        super().__init__(num_worlds, masked=True)

    def _allow(self, buffers):
        super()._allow(buffers)
        buffers.action_mask[self.square == 1] = False


class Unsound(Walk):
    """Pays what is no number."""

    def step(self, actions, buffers):
        super().step(actions, buffers)
        buffers.reward[buffers.reward == 5] = np.nan


class Individual(Walk):
    """Tells the same story whenever it is asked, and no other world tells it."""

    born = 0

    def __init__(self, num_worlds):
        super().__init__(num_worlds)
        Individual.born += 1
        self.own = Individual.born

    def reset(self, buffers, seed):
        super().reset(buffers, seed + self.own)


class Blind(Walk):
    """Goes on from a saved state without a look at it."""

    def load_state(self, state, buffers):
        super().load_state(state, allocate(self.spec))


class Unsteady(Walk):
    """Loads all that can be seen, and forgets how many episodes it began."""

    def load_state(self, state, buffers):
        super().load_state(state | {"episode": state["episode"] + 1}, buffers)


@pytest.mark.parametrize(
    ("cheat", "question"),
    [
        (Individual, "test_the_same_seed_tells_the_same_story"),
        (Blind, "test_a_saved_world_goes_on_as_if_nothing_had_happened"),
        (Unsteady, "test_a_saved_world_goes_on_as_if_nothing_had_happened"),
        (Cornered, "test_what_a_step_brings_is_sound"),
        (Unsound, "test_what_a_step_brings_is_sound"),
    ],
)
def test_a_cheat_of_another_kind_is_caught(cheat, question):
    with pytest.raises(AssertionError):
        examine(cheat, question)


class TestHollowWalk(WorldConformance):
    """A world may promise an observation without a number, as a LiDAR without rays is one."""

    ticks = 40

    def make_world(self, num_worlds):
        world = Walk(num_worlds)
        seen = {**world.spec.observations, "nothing": ArraySpec((0,), np.float32)}
        world.spec = replace(world.spec, observations=seen)
        return world
