"""Several behaviors of one scene as one World."""

import numpy as np

from racecraft.contract.world import (
    POLICY_ID,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    WorldSpec,
    allocate,
)
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import AgentRows, Behavior, Sensor, UnityActions
from racecraft.worlds.unity.env.joint_rows import JointSeats, joint_spec
from racecraft.worlds.unity.env.rows import Seats
from racecraft.worlds.unity.env.session import Moment
from racecraft.worlds.unity.env.world import UnityWorld


def right_answers(world, seen):
    """What the two behaviors of `DuoScene` should do, told from what they see."""
    actions = np.zeros((world.spec.num_worlds, 1, *world.spec.actions.shape), np.float32)
    dots, tellers = world.rows_of["Dot"], world.rows_of["Teller"]
    eyes = seen["Dot/eye"][dots, 0, :, :, 0]
    actions[dots, 0, 0] = eyes[:, :, 8:].sum((1, 2)) > eyes[:, :, :8].sum((1, 2))
    number, bit = seen["Teller/sight"][tellers, 0].T
    actions[tellers, 0] = np.stack([number, bit], axis=1)
    return actions


def test_each_behavior_sees_acts_and_earns_in_its_own_rows(program):
    """Eight dots that ask at every second message, twelve tellers that always ask: everybody answers right, always."""
    world = UnityWorld(program("duo"), several=True)
    assert world.rows_of == {"Dot": slice(0, 8), "Teller": slice(8, 20)}
    assert [behavior.name for behavior in world.behaviors] == ["Dot?team=0", "Teller?team=0"]
    assert set(world.spec.observations) == {POLICY_ID, "Dot/eye", "Teller/sight"}
    assert (world.spec.observations[POLICY_ID].low, world.spec.observations[POLICY_ID].high) == (0, 1)
    assert world.spec.actions == GroupedActions(2)  # a number and a choice; a dot's choice is the first of them
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    assert buffers.action_mask.shape == (20, 1, 3)
    assert buffers.action_mask[:8, 0, :2].all()
    assert buffers.action_mask[8:, 0].tolist() == [[True, True, False]] * 12, "the third is never allowed"
    episodes = []
    for tick in range(6):
        seen = buffers.observations
        assert seen[POLICY_ID][:, 0].tolist() == [0] * 8 + [1] * 12
        assert buffers.active[:, 0].tolist() == [tick % 2 == 0] * 8 + [True] * 12
        assert not seen["Dot/eye"][8:].any()
        assert not seen["Teller/sight"][:8].any()
        world.step(right_answers(world, seen), buffers)
        np.testing.assert_allclose(buffers.reward[8:], 1.0, atol=1e-6)
        np.testing.assert_array_equal(buffers.reward[:8], float(tick % 2))
        np.testing.assert_array_equal(buffers.terminated[:8], bool(tick % 2))
        assert (buffers.final_observations[POLICY_ID] == seen[POLICY_ID]).all()
        episodes += world.pop_episodes()
    world.close()
    assert sum(episode.world < 8 for episode in episodes) == 3 * 8
    assert sum(episode.world >= 8 for episode in episodes) == 6 * 12
    assert np.mean([episode.reward for episode in episodes]) > 1 - 1e-6


def test_one_of_several_is_one_as_ever(program):
    world = UnityWorld(program("duo"), behavior=["Teller", "Nobody"], several=True)
    assert set(world.spec.observations) == {"sight"}
    assert world.rows_of == {"Teller": slice(0, 12)}
    world.close()


def test_two_players_of_a_scene_with_several_behaviors_are_one_batch(program):
    """Rows of a behavior stand together, process 0's first."""
    world = UnityWorld(program("duo"), several=True, num_players=2)
    assert world.rows_of == {"Dot": slice(0, 16), "Teller": slice(16, 40)}
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    world.step(right_answers(world, buffers.observations), buffers)
    np.testing.assert_allclose(buffers.reward[16:], 1.0, atol=1e-6)
    world.close()


SIGHT = Sensor("sight", (1,), (1,))
DOES = {"Chooser": UnityActions(0, (3,)), "Driver": UnityActions(2)}
BEHAVIORS = {name: Behavior(name, (SIGHT,), UnityActions(0, (2,))) for name in ("Chooser", "Driver", "Other")}


def joint():
    """Two rows of one that chooses and one row of one that drives, of one process; somebody else stands about."""
    sees = {"sight": ArraySpec((1,), np.float32)}
    parts = {
        "Chooser": WorldSpec("c", 2, 1, sees, DiscreteActions(3), has_action_mask=True),
        "Driver": WorldSpec("d", 1, 1, sees, ContinuousActions((-1.0,) * 2, (1.0,) * 2)),
    }
    spec = joint_spec(parts, "both")
    seats = [Seats(part, (SIGHT,), ActionTable(DOES[name]), [name], 1) for name, part in parts.items()]
    return spec, JointSeats(parts, seats), allocate(spec)


def told(*agents, choices=0):
    """Agents that each see their own number and earn it."""
    ids = np.array(agents, np.int32)
    sight, none = ids[:, None].astype(np.float32), np.zeros(len(ids), np.float32)
    allowed = np.ones((len(ids), choices), bool) if choices else None
    return AgentRows(ids, [sight], sight[:, 0].copy(), ids * 0, none, none > 0, allowed)


def heard(choosers=(), drivers=(), others=(), gone=((), ())):
    return {
        "Chooser": Moment(told(*choosers, choices=3), told(*gone[0], choices=3)),
        "Driver": Moment(told(*drivers), told(*gone[1])),
        "Other": Moment(told(*others, choices=2), told(choices=2)),
    }


def test_actions_reach_those_who_asked_and_nobody_is_told_for_another():
    """Whoever is acted for and does not ask is told nothing; whoever is not, does nothing."""
    _, seats, _ = joint()
    seats.fill_rows(0, heard([4, 5], [6], [7]), BEHAVIORS, None)
    choices = seats.choices(0, np.array([[[2.0, 9.0]], [[1.0, 9.0]], [[0.5, -0.5]]]))
    assert set(choices) == {"Chooser", "Driver", "Other"}
    assert choices["Chooser"].discrete.tolist() == [[2], [1]]
    assert choices["Driver"].continuous.tolist() == [[0.5, -0.5]]
    assert choices["Other"].discrete.tolist() == [[0]]
    assert list(seats.idle_choices(0)) == ["Other"]
    seats.fill_rows(0, heard([], [6], []), BEHAVIORS, None)
    assert set(seats.choices(0, np.zeros((3, 1, 2)))) == {"Driver"}
    assert seats.idle_choices(0) == {}


def test_what_is_settled_cut_and_cleared_stands_in_each_behaviors_own_rows():
    _, seats, buffers = joint()
    seats.fill_rows(0, heard([4, 5], [6]), BEHAVIORS, None)
    seats.begin_step()
    seats.fill_rows(0, heard([4], [6], gone=([5], [])), BEHAVIORS, buffers)
    seats.show(buffers)
    assert buffers.reward.ravel().tolist() == [4, 5, 6]
    assert buffers.terminated.ravel().tolist() == [False, True, False]
    assert buffers.active.ravel().tolist() == [True, False, True]
    assert buffers.observations[POLICY_ID].ravel().tolist() == [0, 0, 1]
    assert buffers.observations["Chooser/sight"].ravel().tolist() == [4, 5, 0]
    assert buffers.observations["Driver/sight"].ravel().tolist() == [0, 0, 6]
    seats.truncate_all(0, buffers)
    assert buffers.truncated.ravel().tolist() == [True, False, True]
    assert buffers.final_observations["Driver/sight"].ravel().tolist() == [0, 0, 6]
    ended = [(episode.world, episode.reward, episode.status) for episode in seats.pop_episodes()]
    assert ended == [(1, 5.0, "terminated"), (0, 4.0, "truncated"), (2, 6.0, "truncated")]
    seats.clear()
    seats.show(buffers)
    assert not buffers.active.any()
    assert not buffers.observations["Driver/sight"].any()
