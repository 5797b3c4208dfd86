"""Every kind of space is seen, told and learned from; pictures keep their channels last; episodes need not end."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import ContinuousActions, DiscreteActions, HybridActions, MultiDiscreteActions, allocate
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.env import from_gymnasium
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld
from racecraft.worlds.gymnasium.env.spaces import Part, action_translation, parts_of
from racecraft.worlds.gymnasium.training.trainer import GymRequest


class Toy(gymnasium.Env):
    """Shows a bit in many ways; pays 1 for an action that agrees with it; every episode is one step."""

    observation_space, action_space = spaces.Box(0, 1, ()), spaces.Discrete(2)

    def __init__(self):
        self.bit = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.bit = int(self.np_random.integers(2))
        return self.show(self.bit), {}

    def step(self, action):
        assert self.action_space.contains(action), action
        return self.show(0), self.agreement(action), True, False, {}

    def show(self, bit):
        return np.float32(bit)

    def agreement(self, action):
        return float(action == self.bit)


class Choices(Toy):
    observation_space, action_space = spaces.MultiDiscrete([2, 3]), spaces.MultiDiscrete([2, 2])

    def show(self, bit):
        return np.array([bit, 2])

    def agreement(self, action):
        return float(np.mean(action == [self.bit, 1 - self.bit]))


class Both(Toy):
    observation_space = spaces.Tuple((spaces.Discrete(2), spaces.Dict(much=spaces.Box(0, 1, (1,)))))
    action_space = spaces.Tuple((spaces.Discrete(2, start=5), spaces.Box(-1, 1, ())))

    def show(self, bit):
        return bit, {"much": np.float32([bit])}

    def agreement(self, action):
        return 0.5 * (action[0] == 5 + self.bit) + 0.5 * ((action[1] > 0) == (self.bit == 1))


class Endless(Toy):
    """An episode without an end."""

    def step(self, action):
        return self.show(1), 1.0, False, False, {}


@pytest.mark.parametrize("toy", [Both, *(pytest.param(toy, marks=pytest.mark.long) for toy in (Toy, Choices))])
def test_a_toy_of_every_kind_of_space_is_learned(tmp_path, toy):
    request = GymRequest(
        f"{__name__}:{toy.__name__}", run=tmp_path / "run", stops=("score=0.9", "steps=20000"),
        overrides=("evaluation.every=4", "ppo.epochs=4", "ppo.batch_size=256", "rollout.horizon=64"),
    )  # fmt: skip
    trained = train(request, NullCallback(), on_message=lambda _: None)
    assert trained.outcome.last.score >= 0.9
    assert trained.outcome.steps < 20_000


def test_an_episode_without_an_end_holds_nothing_up(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.training.return_evaluator.SHORTEST_PATIENCE", 300)
    monkeypatch.setattr(from_gymnasium, "MAX_HISTORY", 100)
    request = GymRequest(
        f"{__name__}:Endless", run=tmp_path / "run", stops=("iterations=3",),
        overrides=("rollout.horizon=32", "evaluation.episodes=2"),
    )  # fmt: skip
    trained = train(request, NullCallback(), on_message=lambda _: None)
    assert trained.outcome.last.score == 300.0
    world = GymnasiumWorld(Endless, 2)
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    for _ in range(150):
        world.step(np.zeros((2, 1), np.int64), buffers)
    state = world.save_state()
    assert (state["lengths"].tolist(), state["actions"].shape) == ([-1, -1], (2, 0))
    world.load_state(state, buffers)
    assert world.save_state()["episode"].tolist() == [1, 1]


def test_minutes_hold_within_an_evaluation(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.training.return_evaluator.SHORTEST_PATIENCE", 10**9)
    for name, value in (("GRACE_SECONDS", 0.2), ("LOOK_SECONDS", 0.01), ("LAST_EVALUATION_SECONDS", 0.4)):
        monkeypatch.setattr(f"racecraft.training.loop.{name}", value)
    request = GymRequest(
        f"{__name__}:Endless", run=tmp_path / "run", stops=("minutes=0.01",),
        overrides=("evaluation.share=1000", "rollout.horizon=32"),
    )  # fmt: skip
    trained = train(request, NullCallback(), on_message=lambda _: None)
    assert trained.outcome.reason == "minutes=0.01"
    assert trained.outcome.seconds < 60


def test_pictures_with_channels_first_are_seen_as_pictures():
    part = Part((), spaces.Box(0, 255, (3, 8, 6), np.uint8))
    assert part.spec("x").shape == (8, 6, 3)
    frame = np.arange(3 * 8 * 6, dtype=np.uint8).reshape(3, 8, 6)
    out = np.zeros((8, 6, 3), np.uint8)
    part.show(frame, out)
    assert (out[2, 4] == frame[:, 2, 4]).all()
    for shape in ((8, 6, 3), (8, 6), (3, 2, 2), (4, 8, 4)):
        assert Part((), spaces.Box(0, 255, shape, np.uint8)).spec("x").shape == shape


def test_actions_of_every_space():
    tuples = spaces.Tuple((spaces.MultiBinary(2), spaces.Box(-1, 2, (2, 1)), spaces.Discrete(3, start=-1)))
    found = action_translation(tuples, "x")
    assert found.actions == HybridActions(ContinuousActions((-1.0, -1.0), (2.0, 2.0)), MultiDiscreteActions((2, 2, 3)))
    told = found.to_environment(np.float32([0.5, -1.0, 1, 0, 2]))
    assert [part.tolist() for part in told[:2]] == [[1, 0], [[0.5], [-1.0]]]
    assert told[2] == 1
    assert tuples.contains(told)
    assert action_translation(spaces.Discrete(4, start=-1), "x").actions == DiscreteActions(4)
    assert action_translation(spaces.Discrete(4, start=-1), "x").to_environment(np.int64(3)) == 2
    named = spaces.Dict(a=spaces.Discrete(2), b=spaces.MultiDiscrete([3], start=[5]))
    assert action_translation(named, "x").to_environment(np.array([1, 2])) == {"a": 1, "b": np.array([7])}
    with pytest.raises(UserInputError, match="x: actions are Text"):
        action_translation(spaces.Text(3), "x")


def test_observations_are_named_by_the_way_to_them():
    deep = spaces.Dict(a=spaces.Tuple((spaces.Discrete(2), spaces.Box(0, 1, (2,)))), b=spaces.MultiBinary([2, 2]))
    assert {name: part.spec("x").shape for name, part in parts_of(deep, "x").items()} == {
        "a/0": (2,), "a/1": (2,), "b": (4,),
    }  # fmt: skip
    out = np.zeros(5, np.float32)
    Part((), spaces.MultiDiscrete([2, 3], start=[4, 0])).show(np.array([5, 1]), out)
    assert out.tolist() == [0, 1, 0, 1, 0]
    with pytest.raises(IndexError, match="not below"):
        Part((), spaces.MultiDiscrete([2, 3])).show(np.array([2, 0]), out)
    with pytest.raises(UserInputError, match="x: observations a are Graph"):
        parts_of(spaces.Dict(a=spaces.Graph(spaces.Discrete(2), None)), "x")
