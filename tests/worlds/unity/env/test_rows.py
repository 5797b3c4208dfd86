"""Who sits in which row, by hand and without a wire."""

import numpy as np
import pytest

from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, EpisodeRecord, WorldSpec, allocate
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import AgentRows, Behavior, Sensor, UnityActions
from racecraft.worlds.unity.env.errors import UnityError, WireError
from racecraft.worlds.unity.env.rows import Seats
from racecraft.worlds.unity.env.session import Moment

SIGHT = Sensor("sight", (1,), (1,))
CHOOSES, STEERS = UnityActions(0, (2,)), UnityActions(1)


def told(*agents, group=0.0, forbidden=None, actions=CHOOSES, interrupted=False):
    """Rows of agents that each see their own number and earn it, and something for their group."""
    ids = np.array(agents, np.int32)
    sight = ids[:, None].astype(np.float32)
    allowed = np.ones((len(ids), 2), bool) if actions.branches else None
    if forbidden is not None:
        allowed[:, forbidden] = False
    shared = np.full(len(ids), group, np.float32)
    return AgentRows(ids, [sight], sight[:, 0].copy(), ids * 0, shared, np.full(len(ids), interrupted), allowed)


def heard(asking=(), ended=(), **words):
    return {"A": Moment(told(*asking, **words), told(*ended, **words))}


def seats_for(worlds, agents=1, processes=1, actions=CHOOSES):
    kind = DiscreteActions(2) if actions.branches else ContinuousActions((-1.0,), (1.0,))
    spec = WorldSpec("few", worlds, agents, {"sight": ArraySpec((1,), np.float32)}, kind, bool(actions.branches))
    buffers = allocate(spec)
    return Seats(spec, (SIGHT,), ActionTable(actions), ["A"], processes), buffers


def test_every_process_has_as_many_rows_of_its_own():
    seats, buffers = seats_for(4, agents=2, processes=2)
    seats.fill_rows(0, heard([1, 2, 3]), {}, None)
    seats.fill_rows(1, heard([5]), {}, None)
    seats.show(buffers)
    assert buffers.observations["sight"][:, :, 0].tolist() == [[1, 2], [3, 0], [5, 0], [0, 0]]
    assert buffers.active.tolist() == [[True, True], [True, False], [True, False], [False, False]]
    assert seats.choices(1, np.arange(8).reshape(4, 2))["A"].discrete.tolist() == [[4]]
    with pytest.raises(UnityError, match="agent 9 of 'A' asks for a decision, but all 4 rows kept for a player"):
        seats.fill_rows(1, heard([5, 6, 7, 8, 9]), {}, None)


def test_an_episodes_figures_are_its_own():
    """Two steps of reward 3 + 0.5, then an end that brings the same; the next episode's first reward is nobody's."""
    seats, buffers = seats_for(1)
    seats.fill_rows(0, heard([3], group=0.5), {}, None)
    for _ in range(2):
        seats.choices(0, np.zeros((1, 1)))
        seats.fill_rows(0, heard([3], group=0.5), {}, buffers)
    assert buffers.reward.tolist() == [[7.0]], "what is earned is added to what stands there"
    seats.choices(0, np.zeros((1, 1)))
    seats.fill_rows(0, heard([4], [3], group=0.5), {}, buffers)
    assert buffers.terminated.tolist() == [[True]]
    assert buffers.final_observations["sight"].ravel().tolist() == [3]
    seats.choices(0, np.zeros((1, 1)))
    seats.fill_rows(0, heard([], [4], interrupted=True), {}, buffers)
    assert seats.pop_episodes() == [
        EpisodeRecord(0, 0, 3, 10.5, "terminated"),
        EpisodeRecord(0, 0, 1, 4.0, "truncated"),
    ]
    assert seats.pop_episodes() == []


def test_an_agent_whose_id_comes_back_gets_its_row_back():
    """Both end in one message and begin again in the other order."""
    seats, buffers = seats_for(2)
    seats.fill_rows(0, heard([4, 7]), {}, None)
    seats.fill_rows(0, heard([7, 4], [4, 7]), {}, buffers)
    seats.show(buffers)
    assert buffers.observations["sight"].ravel().tolist() == [4, 7]
    assert buffers.terminated.all()
    choices = seats.choices(0, np.array([[0], [1]]))
    assert choices["A"].discrete.tolist() == [[1], [0]], "by position: agent 7 asked first"


def test_an_agent_that_ends_before_it_ever_asked_is_passed_over():
    seats, buffers = seats_for(2)
    seats.fill_rows(0, heard([4], [3]), {}, buffers)
    assert not buffers.ended.any()
    assert seats.pop_episodes() == []


def test_an_agent_that_stands_twice_in_a_message_is_a_lie():
    seats, _ = seats_for(2)
    with pytest.raises(WireError, match="twice"):
        seats.fill_rows(0, heard([4, 4]), {}, None)


def test_rows_that_are_free_again_are_given_in_their_order():
    seats, buffers = seats_for(2)
    seats.fill_rows(0, heard([4, 7]), {}, None)
    seats.fill_rows(0, heard([8, 9], [7, 4]), {}, buffers)
    seats.show(buffers)
    assert buffers.observations["sight"].ravel().tolist() == [8, 9]


def test_with_the_end_of_an_episode_its_mask_ends():
    seats, buffers = seats_for(1)
    seats.fill_rows(0, heard([4], forbidden=1), {}, None)
    seats.show(buffers)
    assert buffers.action_mask.ravel().tolist() == [True, False]
    seats.fill_rows(0, heard([], [4]), {}, buffers)
    seats.show(buffers)
    assert buffers.action_mask.ravel().tolist() == [True, True]


def test_who_does_not_ask_is_not_active_and_shows_what_it_saw_last():
    seats, buffers = seats_for(2)
    seats.fill_rows(0, heard([4, 7]), {}, None)
    seats.begin_step()
    seats.fill_rows(0, heard([7]), {}, buffers)
    seats.show(buffers)
    assert buffers.active.ravel().tolist() == [False, True]
    assert buffers.observations["sight"].ravel().tolist() == [4, 7]
    assert seats.has_decisions(0)
    seats.fill_rows(0, heard(), {}, buffers)
    assert not seats.has_decisions(0)
    assert seats.choices(0, np.zeros((2, 1))) == {}


def test_a_process_that_is_lost_cuts_its_own_episodes():
    seats, buffers = seats_for(2, processes=2)
    for process, agent in enumerate((4, 7)):
        seats.fill_rows(process, heard([agent]), {}, None)
    seats.truncate_all(1, buffers)
    assert (buffers.truncated.ravel().tolist(), buffers.terminated.any()) == ([False, True], False)
    assert buffers.final_observations["sight"].ravel().tolist() == [0, 7]
    assert [(episode.world, episode.status) for episode in seats.pop_episodes()] == [(1, "truncated")]
    seats.fill_rows(1, heard([5]), {}, buffers)
    seats.show(buffers)
    assert buffers.observations["sight"].ravel().tolist() == [4, 5]


def test_what_was_before_a_new_beginning_is_forgotten():
    seats, buffers = seats_for(1)
    seats.fill_rows(0, heard([4], forbidden=0), {}, None)
    seats.truncate_all(0, buffers)
    seats.clear()
    seats.show(buffers)
    assert seats.pop_episodes() == []
    assert (buffers.active.any(), buffers.action_mask.all(), buffers.observations["sight"].any()) == (
        False,
        True,
        False,
    )


def test_agents_without_choices_have_no_mask():
    seats, buffers = seats_for(1, actions=STEERS)
    seats.fill_rows(0, heard([4], actions=STEERS), {}, None)
    seats.show(buffers)
    assert buffers.action_mask is None
    assert seats.choices(0, np.full((1, 1, 1), 0.5))["A"].continuous.tolist() == [[0.5]]


def test_agents_of_other_behaviors_that_ask_do_nothing():
    """Zero numbers, and of choices the first that is allowed."""
    seats, _ = seats_for(1)
    does = {"B": UnityActions(1, (2,)), "C": UnityActions(0, (2,)), "D": UnityActions(2)}
    behaviors = {name: Behavior(name, (SIGHT,), actions) for name, actions in does.items()}
    others = {
        "B": Moment(told(1, 2, forbidden=0), told()),
        "C": Moment(told(), told(3)),
        "D": Moment(told(3, actions=STEERS), told()),
    }
    seats.fill_rows(0, heard([4]) | others, behaviors, None)
    idle = seats.idle_choices(0)
    assert set(idle) == {"B", "D"}
    assert (idle["B"].continuous.tolist(), idle["B"].discrete.tolist()) == ([[0.0], [0.0]], [[1], [1]])
    assert (idle["D"].continuous.tolist(), idle["D"].discrete) == ([[0.0, 0.0]], None)
    assert set(seats.choices(0, np.zeros((1, 1)))) == {"A", "B", "D"}


def test_a_behavior_that_is_gone_is_a_lie():
    seats, buffers = seats_for(1)
    with pytest.raises(WireError, match="no longer has the behavior 'A'"):
        seats.fill_rows(0, {}, {}, buffers)
