"""A vector version of an environment: the same world, ended rows that begin a tick later, and when it is taken."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec, WrapperSpec
from gymnasium.vector import AutoresetMode, VectorEnv

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError, EnvironmentFailedError
from racecraft.contract.world import allocate
from racecraft.rollout.episodes import play_episodes
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld
from racecraft.worlds.gymnasium.env.from_vector_env import VectorEnvWorld, has_vector_version
from racecraft.worlds.gymnasium.evaluation import open_judging_world


def cartpole(rows):
    world = open_judging_world("CartPole-v1", rows)
    assert isinstance(world, VectorEnvWorld)
    return world, allocate(world.spec)


class TestAVectorVersionSitsTheExam(WorldConformance):
    """All but one question: its rows share one stream of chance, so a row is another beside fewer. It only judges."""

    ticks = 120

    def make_world(self, num_worlds):
        return open_judging_world("CartPole-v1", self.num_worlds)


class Countdown(VectorEnv):
    """Row n's episodes last n + 2 ticks; every tick is paid by the action; it shows how many ticks are left."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, num_envs=1, prize=1.0):
        self.num_envs, self.prize = num_envs, prize
        self.single_observation_space, self.single_action_space = spaces.Box(0, 99, (1,)), spaces.Discrete(3, start=1)
        self.left, self.over = np.zeros(num_envs), np.zeros(num_envs, bool)

    def reset(self, *, seed=None, options=None):
        self.left, self.over = np.arange(self.num_envs) + 2.0, np.zeros(self.num_envs, bool)
        return self.left[:, None].astype(np.float32), {}

    def step(self, actions):
        assert actions.min() >= 1, "the first choice is 1"
        begins = self.over
        self.left = np.where(begins, np.arange(self.num_envs) + 2.0, self.left - 1.0)
        self.over = ~begins & (self.left <= 0)
        seen = self.left[:, None].astype(np.float32)
        return seen, self.prize * actions, self.over, np.zeros(self.num_envs, bool), {}


def test_a_row_is_the_same_cart_as_one_alone():
    """Equations of motion in numbers: the vector version and the single one from the same state, 60 ticks."""
    world, buffers = cartpole(3)
    world.reset(buffers, seed=5)
    alone = gymnasium.make("CartPole-v1").unwrapped
    alone.reset(seed=0)
    alone.state = tuple(world._envs.state[:, 1])
    chance = np.random.default_rng(2)
    for tick in range(60):
        actions = chance.integers(2, size=(3, 1))
        world.step(actions, buffers)
        seen, reward, terminated, _, _ = alone.step(int(actions[1, 0]))
        np.testing.assert_allclose(buffers.observations["observation"][1, 0], seen, atol=1e-6)
        assert (buffers.reward[1, 0], buffers.terminated[1, 0]) == (reward, terminated), tick
        if terminated:
            break
    assert 8 < tick < 60


def test_an_ended_row_begins_in_the_tick_behind_which_counts_for_nothing():
    world = VectorEnvWorld("countdown", Countdown(2))
    buffers = allocate(world.spec)
    world.reset(buffers, seed=0)
    buffers.final_observations["observation"][:] = 9  # its end shows 0, as what nobody wrote would
    told = []
    for _ in range(6):
        acts = buffers.active[:, 0].tolist()
        world.step(np.array([[0], [2]]), buffers)
        shown = buffers.observations["observation"][:, 0, 0].tolist()
        told.append((acts, shown, buffers.reward[:, 0].tolist(), buffers.ended[:, 0].tolist()))
    yes, no = True, False
    assert told == [
        ([yes, yes], [1, 2], [1, 3], [no, no]),
        ([yes, yes], [0, 1], [1, 3], [yes, no]),
        ([no, yes], [2, 0], [0, 3], [no, yes]),
        ([yes, no], [1, 3], [1, 0], [no, no]),
        ([yes, yes], [0, 2], [1, 3], [yes, no]),
        ([no, yes], [2, 1], [0, 3], [no, no]),
    ]
    assert buffers.final_observations["observation"].tolist() == [[[0]], [[0]]]
    episodes = [(one.world, one.steps, one.reward, one.status) for one in world.pop_episodes()]
    assert episodes == [(0, 2, 2.0, "terminated"), (1, 3, 9.0, "terminated"), (0, 2, 2.0, "terminated")]


class Always:
    """Plays one action."""

    def __init__(self, action):
        self.action = action

    def act(self, observations, mask=None):
        return np.full(len(next(iter(observations.values()))), self.action)

    def reset_state(self, rows):
        pass


def test_episodes_are_told_as_those_of_copies_are():
    world = VectorEnvWorld("countdown", Countdown(3))
    episodes = play_episodes(Always(1), world, episodes_each=2, seed=1)
    assert [(one.world, one.steps, one.reward) for one in episodes] == [
        (0, 2, 4.0), (0, 2, 4.0), (1, 3, 6.0), (1, 3, 6.0), (2, 4, 8.0), (2, 4, 8.0)
    ]  # fmt: skip
    right = play_episodes(Always(1), cartpole(100)[0], seed=3)
    copies = play_episodes(Always(1), GymnasiumWorld("CartPole-v1", 100), seed=3)
    assert all(one.status == "terminated" for one in right)
    lengths = [np.mean([one.steps for one in each]) for each in (right, copies)]
    assert lengths[0] == pytest.approx(lengths[1], abs=0.5)
    assert [one.steps for one in right] == [one.reward for one in right]


def test_a_saved_story_goes_on():
    world, buffers = cartpole(4)
    world.reset(buffers, seed=9)
    chance = np.random.default_rng(1)
    for _ in range(40):
        world.step(chance.integers(2, size=(4, 1)), buffers)
    state, other, again = world.save_state(), *cartpole(4)
    other.load_state(state, again)
    assert not other.pop_episodes()
    for _ in range(30):
        actions = chance.integers(2, size=(4, 1))
        world.step(actions, buffers)
        other.step(actions, again)
        for name in ("reward", "terminated", "active"):
            np.testing.assert_array_equal(getattr(buffers, name), getattr(again, name))
        np.testing.assert_array_equal(buffers.observations["observation"], again.observations["observation"])
    other.reset(again, seed=10)
    world.reset(buffers, seed=9)
    assert (buffers.observations["observation"] != again.observations["observation"]).any()


def test_what_goes_wrong_in_it_is_a_letter():
    broken = VectorEnvWorld("countdown", Countdown(2, prize=np.nan))
    buffers = allocate(broken.spec)
    with pytest.raises(ContractError, match="step before reset"):
        broken.step(np.array([[0], [0]]), buffers)
    broken.reset(buffers, seed=0)
    with pytest.raises(EnvironmentFailedError, match=r"Countdown\.step gave .* as reward .*; expected numbers"):
        broken.step(np.array([[0], [0]]), buffers)


@pytest.mark.parametrize("name", ["Pendulum-v1", "FrozenLake-v1"])
def test_where_there_is_none_it_is_judged_in_copies(name):
    world = open_judging_world(name, 2)
    assert isinstance(world, GymnasiumWorld)
    world.close()


def test_a_version_whose_rows_begin_at_once_or_show_several_things_is_left_to_copies():
    class AtOnce(Countdown):
        metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    class TwoSights(Countdown):
        def __init__(self, num_envs=1):
            super().__init__(num_envs)
            self.single_observation_space = spaces.Dict(a=spaces.Box(0, 1), b=spaces.Box(0, 1))

        def close(self, **words):
            pass

    single = gymnasium.spec("CartPole-v1").entry_point
    for k, version in enumerate((Countdown, AtOnce, TwoSights)):
        gymnasium.register(f"VectorVersion{k}-v0", entry_point=single, vector_entry_point=version)
    try:
        kinds = [type(open_judging_world(f"VectorVersion{k}-v0", 2)) for k in range(3)]
    finally:
        for k in range(3):
            del gymnasium.registry[f"VectorVersion{k}-v0"]
    assert kinds == [VectorEnvWorld, GymnasiumWorld, GymnasiumWorld]


class Dial(Countdown):
    """As the countdown, told numbers from -1 to 1 by two dials, and cut where it would end."""

    def __init__(self, num_envs=1):
        super().__init__(num_envs)
        self.single_action_space = self.action_space = spaces.Box(-1, 1, (2,))
        self.observation_space = spaces.Box(0, 99, (num_envs, 1))
        self.told, self.seeds, self.closed = [], [], 0

    def reset(self, *, seed=None, options=None):
        self.seeds.append(seed)
        return super().reset(seed=seed)

    def step(self, actions):
        self.told.append(actions.copy())
        seen, reward, over, never, info = super().step(np.ones(self.num_envs))
        return seen, reward * 0.5, never, over, info

    def close(self, **words):
        self.closed += 1


def test_a_row_of_numbers_is_handed_on_and_a_cut_is_told_as_one():
    dial = Dial(2)
    world = VectorEnvWorld("dial", dial)
    buffers = allocate(world.spec)
    assert (world.spec.num_worlds, world.spec.num_agents, world.spec.actions.shape) == (2, 1, (2,))
    world.reset(buffers, seed=2**31 + 5)
    assert dial.seeds == [5], "seeds of Gymnasium are below 2^31"
    assert buffers.active.all()
    actions = np.float32([[[0.25, -1.0]], [[1.0, 0.5]]])
    for _ in range(3):
        world.step(actions, buffers)
    np.testing.assert_array_equal(dial.told[0], actions[:, 0])
    assert buffers.truncated[:, 0].tolist() == [False, True]
    assert not buffers.terminated.any()
    assert buffers.active[:, 0].tolist() == [True, False]
    told = [(one.world, one.agent, one.steps, one.reward, one.status) for one in world.pop_episodes()]
    assert told == [(0, 0, 2, 1.0, "truncated"), (1, 0, 3, 1.5, "truncated")]
    assert world.pop_episodes() == []
    np.testing.assert_array_equal(world.save_state()["actions"], [actions[:, 0]] * 3)
    world.close()
    world.close()
    assert dial.closed == 1


def test_a_registration_has_a_version_where_nothing_is_laid_round_it_and_rows_begin_a_tick_later():
    def registered(**words):
        return EnvSpec("Any-v0", entry_point=Countdown, vector_entry_point=Countdown, **words)

    class NoWord(Countdown):
        metadata = None

    assert has_vector_version(registered())
    assert has_vector_version(gymnasium.spec("CartPole-v1")), "named by its module"
    assert not has_vector_version(registered(kwargs={"prize": 2.0}))
    wrapped = WrapperSpec("any", "gymnasium.wrappers:TimeLimit", {})
    assert not has_vector_version(registered(additional_wrappers=(wrapped,)))
    assert not has_vector_version(EnvSpec("Any-v0", entry_point=Countdown))
    assert not has_vector_version(EnvSpec("Any-v0", entry_point=Countdown, vector_entry_point=NoWord))
