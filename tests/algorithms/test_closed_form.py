"""The written-out way back: what autograd finds, for every setting that it follows."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.closed_form import closed_form_of
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_loss import ppo_loss
from racecraft.algorithms.recurrent_network import RecurrentActorCritic
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

ROWS, WIDTH = 96, 5
CHOICES, NUMBERS = DiscreteActions(4), ContinuousActions((-2.0, -1.0), (2.0, 3.0))


def learner_of(actions, network=None, config=None, **more):
    spec = WorldSpec("toy", 4, 1, {"seen": ArraySpec((WIDTH,), np.float32), **more}, actions)
    return PpoLearner(spec, network or NetworkConfig(hidden_units=(16, 8), activation="tanh"), config or PpoConfig(), 3)


def minibatch(learner, **more):
    """Return transitions on both sides of the clip, with good and bad advantages on each."""
    chance = torch.Generator().manual_seed(7)
    seen = {name: torch.randn(ROWS, *part.shape, generator=chance) for name, part in learner.spec.observations.items()}
    with torch.no_grad():
        params = learner.network.policy(seen)
        raw, log_prob = learner.distribution.sample(params, learner.network.log_std, more.get("action_mask"), chance)
    others = (torch.randn(ROWS, generator=chance) for _ in range(3))
    moved, advantages, targets = others
    return Minibatch(seen, raw, log_prob + 0.3 * moved, advantages, 3.0 * targets, **more)


def by_autograd(learner, batch, config):
    loss, figures = ppo_loss(learner.network, learner.distribution, batch, config)
    learner.network.zero_grad(set_to_none=True)
    loss.backward()
    gradients = {name: one.grad.clone() for name, one in learner.network.named_parameters()}
    learner.network.zero_grad(set_to_none=True)  # what the closed form forgets must not be found here
    return figures, gradients


def assert_as_autograd(learner, batch, config):
    figures, gradients = by_autograd(learner, batch, config)
    torch.testing.assert_close(learner.steps.find_gradients(batch, config), figures, rtol=1e-5, atol=1e-6)
    for name, one in learner.network.named_parameters():
        torch.testing.assert_close(one.grad, gradients[name], rtol=1e-4, atol=1e-6, msg=name)


SETTINGS = {
    "as they begin": {},
    "no entropy": {"entropy_weight": 0.0},
    "huber": {"value_loss": "huber", "value_weight": 0.7},
    "rollout": {"standardise": "rollout"},
    "narrow clip": {"clip": 0.05},
}
NETWORKS = {
    "tanh": NetworkConfig(hidden_units=(16, 8), activation="tanh"),
    "relu, one layer": NetworkConfig(hidden_units=(16,), activation="relu"),
    "apart": NetworkConfig(hidden_units=(16, 8), activation="tanh", separate_networks=True),
    "embedded, normalised": NetworkConfig(hidden_units=(8,), vector_units=(12,), activation="tanh", normalise=True),
}


@pytest.mark.parametrize("actions", [CHOICES, NUMBERS], ids=["choices", "numbers"])
@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
def test_gradients_and_figures_are_those_of_autograd(actions, settings, network):
    config = PpoConfig(**settings)
    learner = learner_of(actions, network, config)
    batch = minibatch(learner)
    if network.normalise:
        learner.network.observe(batch.observations)
    if learner.network.log_std is not None:
        learner.network.log_std.data[:] = torch.tensor([-0.5, 0.2])

    figures, gradients = by_autograd(learner, batch, config)
    found = learner.steps.find_gradients(batch, config)

    assert learner.steps.written_out is not None
    torch.testing.assert_close(found, figures, rtol=1e-5, atol=1e-6)
    for name, one in learner.network.named_parameters():
        torch.testing.assert_close(one.grad, gradients[name], rtol=1e-4, atol=1e-6, msg=name)
    assert 0.1 < float(found[4]) < 0.97, "some decisions must lie beyond the clip, and some within"


def test_masks_and_weights_of_decisions_count():
    learner = learner_of(CHOICES)
    chance = torch.Generator().manual_seed(1)
    mask = torch.rand(ROWS, 4, generator=chance) < 0.6
    mask[:, 2] = True
    batch = minibatch(learner, action_mask=mask, weights=torch.rand(ROWS, generator=chance))
    assert_as_autograd(learner, batch, learner.config)


IMAGE = {"picture": ArraySpec((30, 40), np.uint8)}
OTHERS = {
    "two vectors": learner_of(CHOICES, None, None, more=ArraySpec((2,), np.float32)),
    "a picture": learner_of(CHOICES, None, None, **IMAGE),
    "a floor": learner_of(CHOICES, None, PpoConfig(probability_floor=1e-3)),
    "squashed": learner_of(NUMBERS, None, PpoConfig(distribution="squashed")),
    "half precision": learner_of(CHOICES, None, PpoConfig(precision="bfloat16")),
    "large": learner_of(CHOICES, NetworkConfig(hidden_units=(400, 400))),
}


@pytest.mark.parametrize("learner", OTHERS.values(), ids=OTHERS)
def test_what_is_not_written_out_goes_by_autograd(learner):
    assert learner.steps.written_out is None


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("actions", [CHOICES, NUMBERS], ids=["choices", "numbers"])
def test_a_single_row_has_no_spread_to_be_measured_by_and_two_have(actions, rows):
    learner = learner_of(actions)
    whole = minibatch(learner)
    few = Minibatch(
        {name: part[:rows] for name, part in whole.observations.items()},
        whole.raw_actions[:rows], whole.log_prob[:rows], whole.advantages[:rows], whole.targets[:rows],
    )  # fmt: skip
    assert_as_autograd(learner, few, learner.config)


def test_equal_advantages_pull_nowhere():
    learner = learner_of(CHOICES, config=PpoConfig(entropy_weight=0.0))
    batch = minibatch(learner)
    batch.advantages[:] = 3.0
    assert_as_autograd(learner, batch, learner.config)
    assert not learner.network.policy_head.weight.grad.any()


def test_a_spread_is_pushed_at_its_bounds_and_not_beyond_them():
    """The bounds are e to the -20 and e to the 3. Where no decision was good or bad, the entropy alone pushes."""
    config = PpoConfig(standardise="none", entropy_weight=0.25)
    for log_std in ([-20.0, 3.0], [-20.5, 3.5], [2.5, -1.0]):
        learner = learner_of(NUMBERS)
        learner.network.log_std.data[:] = torch.tensor(log_std)
        batch = minibatch(learner)
        batch.advantages[:], batch.log_prob[:] = 0.0, 100.0
        learner.steps.find_gradients(batch, config)
        assert learner.network.log_std.grad.tolist() == [-0.25 if -20.0 <= one <= 3.0 else 0.0 for one in log_std]


def test_critics_that_read_something_else_and_memories_go_by_autograd():
    told = ArraySpec((2,), np.float32, privileged=True)
    assert learner_of(CHOICES, more=told).steps.written_out is None, "a critic of two vectors"
    row = Architecture(trunk_units=(4,), memory="gru", memory_units=3)
    memory = RecurrentActorCritic({"seen": ArraySpec((WIDTH,), np.float32)}, CHOICES, row, torch.Generator())
    assert closed_form_of(memory, learner_of(CHOICES).distribution) is None
