"""The written-out way back: what autograd finds, for every setting that it follows."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner, ppo_loss
from racecraft.algorithms.ppo_batch import Minibatch
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
    return figures, {name: one.grad.clone() for name, one in learner.network.named_parameters()}


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
    found = learner.find_gradients(batch, config)

    assert learner.written_out is not None
    torch.testing.assert_close(found, figures, rtol=1e-5, atol=1e-6)
    for name, one in learner.network.named_parameters():
        torch.testing.assert_close(one.grad, gradients[name], rtol=1e-4, atol=1e-6, msg=name)
    assert 0.1 < float(found[4]) < 0.97, "some decisions must lie beyond the clip, and some within"


def test_masks_and_weights_of_decisions_count():
    config = PpoConfig()
    learner = learner_of(CHOICES)
    chance = torch.Generator().manual_seed(1)
    mask = torch.rand(ROWS, 4, generator=chance) < 0.6
    mask[:, 2] = True
    batch = minibatch(learner, action_mask=mask, weights=torch.rand(ROWS, generator=chance))
    figures, gradients = by_autograd(learner, batch, config)

    torch.testing.assert_close(learner.find_gradients(batch, config), figures, rtol=1e-5, atol=1e-6)
    for name, one in learner.network.named_parameters():
        torch.testing.assert_close(one.grad, gradients[name], rtol=1e-4, atol=1e-6, msg=name)


def test_a_spread_at_its_bound_is_not_pushed_further():
    learner = learner_of(NUMBERS)
    learner.network.log_std.data[:] = torch.tensor([4.0, 0.0])
    batch = minibatch(learner)
    _, gradients = by_autograd(learner, batch, learner.config)
    learner.find_gradients(batch, learner.config)
    assert learner.network.log_std.grad[0] == gradients["log_std"][0] == 0.0
    assert learner.network.log_std.grad[1] == pytest.approx(float(gradients["log_std"][1]), rel=1e-4)


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
    assert learner.written_out is None
