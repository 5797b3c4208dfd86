"""Several behaviors of one scene as one World."""

import numpy as np

from racecraft.contract.world import POLICY_ID, GroupedActions, allocate
from racecraft.envs.unity.world import UnityWorld


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
        episodes += world.take_episodes()
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
