"""Our worlds as others like to see them, held to the others' own checkers, and theirs held to our exam."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_array_equal
from toy_world import LIMIT, Walk

from racecraft.adapters.gymnasium_env import WorldEnv
from racecraft.adapters.gymnasium_vector import WorldVectorEnv
from racecraft.adapters.pettingzoo_parallel import pettingzoo_parallel
from racecraft.adapters.sb3_vec_env import sb3_vec_env
from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError, UserInputError
from racecraft.contract.world import ContinuousActions, allocate
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld


class TestCartPoleSitsTheExam(WorldConformance):
    ticks = 120

    def make_world(self, num_worlds):
        return GymnasiumWorld("CartPole-v1", num_worlds)


class TestPendulumSitsTheExam(WorldConformance):
    ticks = 210  # the clock cuts it at 200

    def make_world(self, num_worlds):
        return GymnasiumWorld("Pendulum-v1", num_worlds)


class TestFrozenLakeSitsTheExam(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return GymnasiumWorld("FrozenLake-v1", num_worlds)


class TestADictionarySitsTheExam(WorldConformance):
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
    assert list(GymnasiumWorld("Blackjack-v1", 1).spec.observations) == ["0", "1", "2"]


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
    world.freeze(np.array([[False], [True], [False]]))
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


def test_an_env_begins_as_its_seed_says_and_anew_where_one_comes_after_an_end():
    env = WorldEnv(Walk(1, masked=True))
    first = env.reset(seed=5)[0]["square"]
    assert_array_equal(env.reset(seed=5)[0]["square"], first)
    for _ in range(LIMIT):
        *_, info = env.step(2)
    assert env.world.episode[0, 0] == 1
    seen, info = env.reset(seed=5)
    assert env.world.episode[0, 0] == 0
    assert_array_equal(seen["square"], first)
    assert info["active"] is True
    assert info["action_mask"].dtype == np.int8
    assert info["action_mask"].tolist() == [1, 1, 1]
    _, reward, terminated, truncated, _ = env.step(1)
    assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)
    assert reward == first.argmax()
    with pytest.raises(ContractError, match="walk has 1 worlds of 2 agents"):
        WorldEnv(Walk(1, 2))


def test_rows_of_a_vector_env_are_agents_world_by_world():
    env = WorldVectorEnv(Walk(2, 3, masked=True))
    assert (env.num_envs, env.single_action_space, env.action_space.shape) == (6, gymnasium.spaces.Discrete(3), (6,))
    seen, info = env.reset(seed=3)
    assert_array_equal(seen["square"].argmax(axis=1), env.world.square.reshape(-1))
    assert info["_active"].tolist() == info["_action_mask"].tolist() == [True] * 6
    env.world.square[:] = [[1, 5, 5], [5, 5, 8]]
    _, reward, terminated, truncated, info = env.step([0, 1, 2, 0, 1, 2])
    assert reward.tolist() == [0, 5, 6, 4, 5, 8]
    assert reward.dtype == np.float64
    assert terminated.tolist() == [True, *[False] * 5]
    assert not truncated.any()
    assert info["_final_obs"].tolist() == terminated.tolist()
    assert info["final_obs"][0]["square"].argmax() == 0
    assert list(info["final_obs"][1:]) == [None] * 5
    kept = reward, terminated, info["active"], info["action_mask"]
    before = [one.copy() for one in kept]
    env.world.square[:] = 1
    env.step([0, 0, 0, 0, 0, 0])
    for one, other in zip(kept, before, strict=True):
        assert_array_equal(one, other)


def test_stable_baselines3_asks_for_rows_by_number():
    pytest.importorskip("stable_baselines3")
    env = sb3_vec_env(Walk(3, 2, masked=True), seed=4)
    assert env.num_envs == 6
    first = env.reset()["square"]
    env.world.square[:] = [[1, 5], [5, 5], [1, 8]]
    seen, reward, ended, infos = env.step(np.array([1, 1, 0, 2, 0, 2]))
    assert_array_equal(seen["square"].argmax(axis=1)[:4], [1, 5, 4, 6])
    assert reward.tolist() == [1, 5, 4, 6, 0, 8]
    assert ended.tolist() == [False, False, False, False, True, False]
    assert infos[4]["terminal_observation"]["square"].argmax() == 0
    assert infos[4]["TimeLimit.truncated"] is False
    assert infos[:4] == [{}] * 4
    assert env.reset_infos == [{}] * 6
    masks = env.env_method("action_masks", indices=[0, 1])
    assert [mask.tolist() for mask in masks] == [[False, True, True], [True, True, True]]
    assert env.get_attr("render_mode", indices=[0, 2]) == [None, None]
    assert env.get_attr("closed") == [0] * 6
    assert env.env_is_wrapped(gymnasium.Wrapper, indices=0) == [False]
    with pytest.raises(AttributeError, match="'seed' cannot be set row by row"):
        env.set_attr("seed", 3)
    with pytest.raises(AttributeError, match="no method 'seed' for single rows"):
        env.env_method("seed")
    with pytest.raises(AttributeError, match="no method 'action_masks'"):
        sb3_vec_env(Walk(1)).env_method("action_masks")
    env.reset()
    assert_array_equal(sb3_vec_env(Walk(3, 2), seed=4).reset()["square"], first)
    env.close()
    assert env.world.closed == 1


def test_stable_baselines3_begins_its_series_of_starts_with_every_seed():
    pytest.importorskip("stable_baselines3")
    env = sb3_vec_env(Walk(8))
    series = [env.reset()["square"].tolist() for _ in range(3)]
    assert series[0] != series[1] != series[2] != series[0]
    assert sb3_vec_env(Walk(8), seed=0).reset()["square"].tolist() == series[0]
    env.seed(0)
    assert [env.reset()["square"].tolist() for _ in range(3)] == series


def test_agents_of_pettingzoo_leave_as_they_end_and_the_next_game_waits():
    pytest.importorskip("pettingzoo")
    world = Walk(1, 3, masked=True)
    env = pettingzoo_parallel(world)
    assert env.possible_agents == ["agent_0", "agent_1", "agent_2"]
    assert env.metadata["name"] == "walk"
    seen, infos = env.reset(seed=3)
    starts = {name: one["square"].argmax() for name, one in seen.items()}
    assert list(infos) == env.agents == env.possible_agents
    assert infos["agent_0"]["active"] is True
    assert infos["agent_0"]["action_mask"].dtype == np.int8
    world.square[:] = [[1, 5, 5]]
    seen, reward, terminated, truncated, _ = env.step({"agent_0": 0, "agent_2": 2})
    assert reward == {"agent_0": 0.0, "agent_1": 4.0, "agent_2": 6.0}, "who says nothing takes the first choice"
    assert type(reward["agent_1"]) is float
    assert terminated == {"agent_0": True, "agent_1": False, "agent_2": False}
    assert truncated == dict.fromkeys(terminated, False)
    assert seen["agent_0"]["square"].argmax() == 0
    assert seen["agent_2"]["square"].argmax() == 6
    assert env.agents == ["agent_1", "agent_2"]
    for _ in range(LIMIT - 1):
        seen, reward, _, truncated, _ = env.step({"agent_1": 2, "agent_2": 2})
    assert truncated == {"agent_1": True, "agent_2": True}
    assert seen["agent_1"]["clock"] == LIMIT
    assert env.agents == []
    episode = world.episode.copy()
    assert (episode >= 1).all()
    assert list(env.reset()[0]) == env.possible_agents
    assert_array_equal(world.episode, episode)
    env.reset()  # in the middle of a game: the world is begun anew
    assert not world.episode.any()
    again = env.reset(seed=3)[0]
    assert {name: one["square"].argmax() for name, one in again.items()} == starts
