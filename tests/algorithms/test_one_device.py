"""Every learner keeps to its own device: on a stand-in for a graphics card, two devices must not meet.

The stand-in is PyTorch's device "meta", which knows shapes and no numbers; what is read from it is zeros.
"""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.overrides import TorchFunctionMode
from torch.utils._pytree import tree_leaves
from toy_world import Walk

from racecraft.algorithms.alphazero import SEARCHED, AlphaZeroConfig, AlphaZeroLearner
from racecraft.algorithms.apex import ApexConfig, ApexLearner
from racecraft.algorithms.behaviour_cloning import BcConfig, BcLearner
from racecraft.algorithms.dqn import DqnConfig, DqnLearner
from racecraft.algorithms.es import EsConfig, EsLearner
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.recurrent_ppo import RecurrentPpoLearner
from racecraft.algorithms.reinforce import ReinforceConfig, ReinforceLearner
from racecraft.algorithms.sac import SacConfig, SacLearner
from racecraft.contract.world import ArraySpec
from racecraft.rollout.collector import Collector
from racecraft.rollout.demonstrate import demonstrate
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig

CARD = "meta"
NETWORK = NetworkConfig(hidden_units=(8,))
READ = ("cpu", "item", "tolist", "__int__", "__float__", "__bool__")
MAY_MEET = ("to", "copy_", "_has_compatible_shallow_copy_type", "__set__", "__getitem__", "__setitem__")
"""What takes tensors of two devices: copies, and indices from the processor."""


class CardsChance(torch.Generator):
    """Chance of the stand-in."""

    device = torch.device(CARD)


class AnyChance(torch.Generator):
    """In the place of `torch.Generator`: of the stand-in, where it is asked for."""

    usual = torch.Generator

    def __new__(cls, device="cpu"):
        return CardsChance() if torch.device(device).type == CARD else cls.usual()


class OneDevice(TorchFunctionMode):
    """Refuses what a graphics card refuses: tensors of two devices in one operation, another device's chance."""

    def __torch_function__(self, func, types, args=(), kwargs=None):
        name, kwargs = getattr(func, "__name__", ""), dict(kwargs or {})
        tensors = [one for one in tree_leaves((args, kwargs)) if isinstance(one, torch.Tensor)]
        if name in READ and tensors[0].device.type == CARD:
            zeros = torch.zeros(tensors[0].shape, dtype=tensors[0].dtype)
            return zeros if name == "cpu" else getattr(zeros, name)()
        found = {one.device.type for one in tensors if one.dim()}
        if name not in MAY_MEET:
            assert len(found) < 2, f"{name} is given tensors of {sorted(found)}"
        if kwargs.get("generator") is not None:
            wanted = torch.device(kwargs.get("device") or (found.pop() if found else "cpu")).type
            assert kwargs["generator"].device.type == wanted, f"{name} draws on {wanted} by another device's chance"
            del kwargs["generator"]
        if name == "nonzero" and CARD in found:
            return torch.zeros((1, tensors[0].dim()), dtype=torch.int64, device=CARD)
        if name == "_fused_adam_":  # has no stand-in; its tensors were looked at
            return None
        return func(*args, **kwargs)


@pytest.fixture
def card(monkeypatch):
    monkeypatch.setattr(torch, "Generator", AnyChance)
    with OneDevice():
        yield CARD


class SearchedWalk(Walk):
    """A walk whose world also says how often a search walked each choice: every choice alike."""

    def __init__(self, num_worlds):
        super().__init__(num_worlds)
        observations = {**self.spec.observations, SEARCHED: ArraySpec((3,), np.float32)}
        self.spec = replace(self.spec, observations=observations)

    def _show(self, named, rows=True):
        super()._show(named, rows)
        named[SEARCHED][:] = 1 / 3


class Up:
    """Walks up by numbers."""

    def act(self, observations, action_mask=None):
        return np.full((len(observations["clock"]), 1), 0.8, np.float32)

    def reset_state(self, rows):
        pass


@pytest.mark.parametrize(
    ("learner", "config", "network", "world"),
    [
        (PpoLearner, PpoConfig(batch_size=8), NETWORK, Walk(2)),
        (PpoLearner, PpoConfig(batch_size=8, distribution="squashed"), NETWORK, Walk(2, continuous=True)),
        (PpoLearner, PpoConfig(asynchronous=True), NETWORK, Walk(2, masked=True)),
        (RecurrentPpoLearner, PpoConfig(), NetworkConfig(hidden_units=(8,), memory="gru"), Walk(2)),
        (ReinforceLearner, ReinforceConfig(), NETWORK, Walk(2, continuous=True)),
        (EsLearner, EsConfig(), NETWORK, Walk(2, masked=True)),
        (AlphaZeroLearner, AlphaZeroConfig(), NETWORK, SearchedWalk(2)),
    ],
)
def test_a_learner_of_rollouts_keeps_to_its_device(card, learner, config, network, world):
    made = learner(world.spec, network, config, 1, card)
    made.update(Collector(world, made, horizon=16, seed=1).collect())
    made.load_state_dict(made.state_dict())
    assert {part.device.type for part in made.state_dict()["network"].values()} == {card}


@pytest.mark.parametrize(
    ("learner", "config", "world"),
    [
        (DqnLearner, DqnConfig(max_grad_norm=1.0, double=True), Walk(2, masked=True)),
        (ApexLearner, ApexConfig(train_every=4), Walk(2)),
        (SacLearner, SacConfig(noise_correlation=0.5), Walk(2, continuous=True)),
    ],
)
def test_a_learner_of_a_replay_keeps_to_its_device(card, learner, config, world):
    made = learner(world.spec, NETWORK, config, 1, card)
    memory = ReplayConfig(capacity=200, learning_starts=1, prioritised=learner is ApexLearner)
    replay = Replay(world.spec, memory, made.discount, made.n_step, made.columns)
    replay.add(Collector(world, made, horizon=16, seed=1).collect())
    made.update(replay)
    made.load_state_dict(made.state_dict())
    assert {part.device.type for part in made.state_dict()["network"].values()} == {card}


def test_a_clone_keeps_to_its_device(card):
    world = Walk(2, continuous=True)
    made = BcLearner(world.spec, NETWORK, BcConfig(), demonstrate(Up(), world, 12, seed=1), 1, card)
    made.update(None)
    assert {part.device.type for part in made.state_dict()["network"].values()} == {card}
