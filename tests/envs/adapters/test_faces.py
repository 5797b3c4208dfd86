"""Our worlds as others like to see them, held to the others' own checkers, and theirs held to our exam."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_array_equal
from toy_world import LIMIT, Walk

from racecraft.contract.errors import ContractError, UserInputError
from racecraft.contract.exam import WorldExam
from racecraft.contract.world import ContinuousActions, allocate
from racecraft.envs.adapters.from_gymnasium import GymnasiumWorld
from racecraft.envs.adapters.gymnasium_env import WorldEnv
from racecraft.envs.adapters.gymnasium_vector import WorldVectorEnv
from racecraft.envs.adapters.pettingzoo_parallel import pettingzoo_parallel
from racecraft.envs.adapters.sb3_vec_env import sb3_vec_env


class TestCartPoleSitsTheExam(WorldExam):
    ticks = 120

    def make_world(self, num_worlds):
        return GymnasiumWorld("CartPole-v1", num_worlds)


class TestPendulumSitsTheExam(WorldExam):
    ticks = 210  # the clock cuts it at 200

    def make_world(self, num_worlds):
        return GymnasiumWorld("Pendulum-v1", num_worlds)


class TestFrozenLakeSitsTheExam(WorldExam):
    ticks = 60

    def make_world(self, num_worlds):
        return GymnasiumWorld("FrozenLake-v1", num_worlds)


class TestADictionarySitsTheExam(WorldExam):
    ticks = 40

    def make_world(self, num_worlds):
        return GymnasiumWorld(lambda: WorldEnv(Walk(1)), num_worlds)


def test_a_pendulum_cut_by_the_clock_shows_where_it_was():
    """By twin: the same environment, driven by hand with the same seed."""
    world = GymnasiumWorld("Pendulum-v1", 1)
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    twin = gymnasium.make("Pendulum-v1")
    twin.reset(seed=0)
    twin.unwrapped.state = world._envs[0].unwrapped.state.copy()
    for _ in range(200):
        last = twin.step(np.float32([0.5]))
        world.step(np.full((1, 1, 1), 0.5, np.float32), buffers)
    assert buffers.truncated[0, 0]
    assert not buffers.terminated[0, 0]
    assert_array_equal(buffers.final_observations["observation"][0, 0], last[0])
    assert (buffers.observations["observation"][0, 0] != last[0]).any()
    assert world.spec.actions == ContinuousActions((-2.0,), (2.0,))


def test_unknown_ids_and_strange_spaces_are_refused_in_words():
    with pytest.raises(UserInputError, match="Gymnasium cannot make 'CartPool-v1'"):
        GymnasiumWorld("CartPool-v1", 1)
    with pytest.raises(UserInputError, match="FlattenObservation"):
        GymnasiumWorld("Blackjack-v1", 1)


@pytest.mark.filterwarnings("ignore::UserWarning")  # the checker asks for a render mode and a registered spec
@pytest.mark.parametrize("continuous", [False, True])
def test_gymnasiums_own_checker_accepts_our_env(continuous):
    check_env(WorldEnv(Walk(1, continuous=continuous)), skip_render_check=True)


def test_an_env_shows_the_end_and_then_the_start_that_the_world_had_begun():
    env = WorldEnv(Walk(1))
    env.reset(seed=1)
    for _ in range(LIMIT):
        seen, _, terminated, truncated, info = env.step(2)
    assert (terminated, truncated, info["active"]) == (False, True, True)
    assert seen["clock"] == LIMIT
    seen, _ = env.reset()
    assert seen["clock"] == 0
    assert env.world.episode[0, 0] == 1
    env.step(2)
    env.reset()  # in the middle: the world is begun anew
    assert env.world.episode[0, 0] == 0
    with pytest.raises(ContractError, match="Use WorldVectorEnv"):
        WorldEnv(Walk(2))
    assert env.world.closed == 0
    env.close()
    assert env.world.closed == 1


def test_a_vector_env_tells_its_endings_as_gymnasiums_same_step_mode_does():
    """By twin: gymnasium's own SyncVectorEnv over single envs with the same starts."""
    ours = WorldVectorEnv(Walk(3, masked=True))
    seen, info = ours.reset(seed=5)
    assert seen in ours.observation_space
    assert info["action_mask"].shape == (3, 3)
    mode = gymnasium.vector.AutoresetMode.SAME_STEP
    sync = gymnasium.vector.SyncVectorEnv([lambda: WorldEnv(Walk(1, masked=True))] * 3, autoreset_mode=mode)
    sync.reset(seed=5)
    for n, env in enumerate(sync.envs):
        env.world.square[:] = ours.world.square[n]
        env.world.clock[:] = ours.world.clock[n]
    told_endings = 0
    rng = np.random.default_rng(0)
    for _ in range(LIMIT):
        actions = rng.integers(1, 3, 3)
        mine, its = ours.step(actions), sync.step(actions)
        assert_array_equal(mine[1], its[1])
        assert_array_equal(mine[2], its[2])
        assert_array_equal(mine[3], its[3])
        assert ("final_obs" in mine[4]) == ("final_obs" in its[4])
        if "final_obs" in mine[4]:
            told_endings += 1
            assert_array_equal(mine[4]["_final_obs"], its[4]["_final_obs"])
            for one, other in zip(mine[4]["final_obs"], its[4]["final_obs"], strict=True):
                assert_array_equal(one["square"], other["square"])
                assert_array_equal(one["clock"], other["clock"])
    assert told_endings
    ours.close()
    assert ours.world.closed == 1


def test_a_vector_env_begins_as_its_seed_says_and_without_one_each_time_otherwise():
    env = WorldVectorEnv(Walk(8))
    starts = [env.reset(seed=seed)[0]["square"].tolist() for seed in (5, 6, 5)]
    assert starts[0] == starts[2] != starts[1]
    assert env.reset(seed=[5])[0]["square"].tolist() == starts[0]
    assert env.reset()[0]["square"].tolist() != env.reset()[0]["square"].tolist()


def test_stable_baselines3_learns_on_our_world():
    stable_baselines3 = pytest.importorskip("stable_baselines3")
    env = sb3_vec_env(Walk(4), seed=1)
    model = stable_baselines3.PPO("MultiInputPolicy", env, n_steps=16, batch_size=32, n_epochs=1, device="cpu", seed=3)
    model.learn(64)
    env.seed(9)
    first = env.reset()["square"]
    assert_array_equal(first, sb3_vec_env(Walk(4), seed=9).reset()["square"])
    assert (env.reset()["square"] != first).any()


def test_stable_baselines3_is_told_of_cuts_and_shown_the_end():
    pytest.importorskip("stable_baselines3")
    env = sb3_vec_env(Walk(2, masked=True), seed=1)
    env.reset()
    for _ in range(LIMIT):
        seen, _, ended, infos = env.step(np.array([2, 2]))
    assert ended.all()
    assert infos[1]["TimeLimit.truncated"]
    assert infos[1]["terminal_observation"]["clock"] == LIMIT
    assert_array_equal(seen["clock"], [[0], [0]])
    assert len(env.env_method("action_masks")) == 2


def test_an_end_in_the_last_tick_of_the_time_is_an_end_to_stable_baselines3():
    """Value follows a cut and not an end; where both fall together nothing follows."""
    pytest.importorskip("stable_baselines3")

    class EndsWhereItIsCut(Walk):
        def step(self, actions, buffers):
            super().step(actions, buffers)
            buffers.terminated |= buffers.truncated

    env = sb3_vec_env(EndsWhereItIsCut(2, masked=True), seed=1)
    env.reset()
    for _ in range(LIMIT):
        _, _, ended, infos = env.step(np.array([2, 2]))
    assert ended.all()
    assert not infos[1]["TimeLimit.truncated"]


def test_pettingzoos_own_checker_accepts_our_parallel_env():
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(pettingzoo_parallel(Walk(1, 3)), num_cycles=60)
    parallel_seed_test(lambda: pettingzoo_parallel(Walk(1, 2)), num_cycles=20)
    with pytest.raises(ContractError, match="ParallelEnv is for one"):
        pettingzoo_parallel(Walk(2, 2))
    world = Walk(1, 2)
    pettingzoo_parallel(world).close()
    assert world.closed == 1


def test_a_parked_copy_stands_until_the_next_reset():
    world, alone = GymnasiumWorld("CartPole-v1", 3), GymnasiumWorld("CartPole-v1", 3)
    one, other = allocate(world.spec), allocate(world.spec)
    world.reset(one, 4)
    alone.reset(other, 4)
    stood = one.observations["observation"][1].copy()
    world.park(np.array([[False], [True], [False]]))
    for _ in range(30):
        world.step(np.ones((3, 1), np.int64), one)
        alone.step(np.ones((3, 1), np.int64), other)
        assert np.array_equal(one.observations["observation"][1], stood)
        assert one.reward[1] == 0.0
        assert not one.ended[1].any()
        for n in (0, 2):
            assert np.array_equal(one.observations["observation"][n], other.observations["observation"][n])
    again = allocate(world.spec)
    alone.load_state(world.save_state(), again)
    assert np.array_equal(again.observations["observation"], one.observations["observation"])
    world.reset(one, 4)
    world.step(np.ones((3, 1), np.int64), one)
    assert not np.array_equal(one.observations["observation"][1], stood)
