"""A few rows through a small network in NumPy: what PyTorch gives, of the weights as they stand now."""

import copy

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.quick_look import MOST_PRODUCTS, QuickLook, quick_look
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

CHOICES, NUMBERS = DiscreteActions(5), ContinuousActions((-1.0, -2.0), (1.0, 2.0))


def learner_of(actions=CHOICES, seen=(7,), **network):
    spec = WorldSpec("toy", 4, 1, {"seen": ArraySpec(seen, np.float32)}, actions)
    settings = NetworkConfig(**{"hidden_units": (16, 8), "activation": "tanh", "separate_networks": True, **network})
    return PpoLearner(spec, settings, PpoConfig(), seed=3)


def rows(count, *shape):
    return torch.from_numpy(np.random.default_rng(count).normal(size=(count, *shape)).astype(np.float32))


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("actions", [CHOICES, NUMBERS])
@pytest.mark.parametrize("seen", [(7,), (3, 2)])
def test_it_gives_what_pytorch_gives(activation, actions, seen):
    network = learner_of(actions, seen, activation=activation).network
    quick = quick_look(network)
    for part in network.policy_head.parameters():
        torch.nn.init.normal_(part)  # else nearly nothing comes out, whatever goes in
    found = quick.params(rows(6, *seen))
    torch.testing.assert_close(found, network.policy({"seen": rows(6, *seen)}).detach(), rtol=1e-5, atol=1e-6)
    assert found.dtype == torch.float32
    assert found.abs().max() > 0.1


def test_it_follows_what_is_learned():
    network = learner_of().network
    quick = quick_look(network)
    before = quick.params(rows(3, 7))
    with torch.no_grad():
        for part in network.parameters():
            part.add_(0.3)
    after = quick.params(rows(3, 7))
    assert not torch.equal(before, after)
    torch.testing.assert_close(after, network.policy({"seen": rows(3, 7)}).detach())


def test_a_copy_reads_its_own_weights():
    policy = learner_of().policy
    policy.params({"seen": rows(3, 7)})
    twin = copy.deepcopy(policy)
    with torch.no_grad():
        for part in twin.network.parameters():
            part.zero_()
    assert twin.params({"seen": rows(3, 7)}).abs().max() == 0.0
    assert policy.params({"seen": rows(3, 7)}).abs().max() > 0.0


def test_what_is_seen_stays_as_it_was():
    seen = rows(4, 7)
    quick_look(learner_of(hidden_units=(7,)).network).params(seen)
    assert torch.equal(seen, rows(4, 7))


@pytest.mark.parametrize(
    "settings", [{"normalise": True}, {"memory": "lstm"}, {"seen": (8, 8, 1)}], ids=["scaled", "memory", "picture"]
)
def test_other_networks_are_pytorchs(settings):
    if "seen" in settings:
        settings |= {"conv_filters": (4,), "conv_kernels": (3,), "conv_strides": (1,)}
    assert quick_look(learner_of(**settings).network) is None


def test_many_rows_are_pytorchs():
    quick = quick_look(learner_of(hidden_units=(64, 64)).network)
    assert isinstance(quick, QuickLook)
    assert quick.params(rows(MOST_PRODUCTS // 64**2, 7)) is not None
    assert quick.params(rows(MOST_PRODUCTS // 64**2 + 1, 7)) is None


def test_so_many_products_are_where_openblas_takes_more_threads():
    """Its `interface/gemm.c`: SMP_THRESHOLD_MIN, 65,536, times GEMM_MULTITHREAD_THRESHOLD, 4."""
    assert MOST_PRODUCTS == 65_536 * 4


def test_pictures_and_lone_numbers_are_read_as_they_are():
    """Whole numbers become float32; behind the last layer nothing bends."""
    network = learner_of(hidden_units=(3,), activation="relu").network
    with torch.no_grad():
        network.policy_head.bias.copy_(torch.tensor([-1.0, 2.0, -3.0, 4.0, -5.0]))
        network.policy_head.weight.zero_()
    found = quick_look(network).params(torch.ones(2, 7, dtype=torch.float64))
    assert found.tolist() == [[-1.0, 2.0, -3.0, 4.0, -5.0]] * 2
    assert found.dtype == torch.float32


def test_a_learner_decides_by_it():
    learner = learner_of()
    asked = []
    params = learner.policy._quick.params
    learner.policy._quick.params = lambda seen: asked.append(len(seen)) or params(seen)
    learner.act({"seen": rows(4, 7).numpy()})
    learner.choose({"seen": rows(2, 7).numpy()})
    assert asked == [4, 2]
