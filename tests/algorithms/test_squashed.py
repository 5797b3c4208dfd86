"""The squashed normal: by hand, and by twin with PyTorch's own transformed distribution."""

import math

import numpy as np
import pytest
import torch
from torch.distributions import Independent, Normal, TransformedDistribution
from torch.distributions.transforms import TanhTransform

from racecraft.algorithms.distributions import SquashedGaussian, distribution_for
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.sac import sample_actions
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, WorldSpec

TWO = ContinuousActions((-1.0, 0.0), (1.0, 10.0))


def its_twin(mean, log_std):
    return Independent(TransformedDistribution(Normal(mean, log_std.exp()), [TanhTransform(cache_size=1)]), 1)


def parameters(rows=64, seed=0):
    chance = torch.Generator().manual_seed(seed)
    mean = torch.randn((rows, 2), generator=chance)
    return mean, torch.randn((rows, 2), generator=chance) * 0.5 - 0.5


def test_the_density_of_a_half():
    # atanh(1/2) = ln(3) / 2; the tanh's slope there is 1 - 1/4.
    raw = torch.full((1, 1), math.log(3) / 2)
    kind = SquashedGaussian(ContinuousActions((-1.0,), (1.0,)))
    log_prob, _ = kind.log_prob_and_entropy(torch.zeros(1, 1), torch.zeros(1), None, raw)
    normal = -0.5 * (math.log(3) / 2) ** 2 - 0.5 * math.log(2 * math.pi)
    assert log_prob.item() == pytest.approx(normal - math.log(0.75), rel=1e-6)
    assert kind.to_actions(raw).item() == pytest.approx(0.5)


def test_densities_are_those_of_the_transformed_distribution():
    mean, log_std = parameters()
    kind, twin = SquashedGaussian(TWO), its_twin(mean, log_std)
    raw, log_prob = kind.sample(mean, log_std, None, torch.Generator().manual_seed(1))
    torch.testing.assert_close(log_prob, twin.log_prob(torch.tanh(raw)), rtol=1e-4, atol=1e-3)
    again, _ = kind.log_prob_and_entropy(mean, log_std, None, raw)
    torch.testing.assert_close(again, log_prob)


def test_what_sac_draws_has_the_transformed_distributions_density_and_gradients():
    mean, log_std = (one.double().requires_grad_() for one in parameters())
    noise = torch.randn(mean.shape, generator=torch.Generator().manual_seed(2)).double()
    actions, log_prob = sample_actions(mean, log_std, noise)
    ours = torch.autograd.grad((actions.sum() + log_prob.sum()), (mean, log_std))

    twin = its_twin(mean, log_std)
    its_actions = torch.tanh(mean + log_std.exp() * noise)
    its_log_prob = twin.log_prob(its_actions)
    its = torch.autograd.grad((its_actions.sum() + its_log_prob.sum()), (mean, log_std))
    torch.testing.assert_close(actions, its_actions)
    torch.testing.assert_close(log_prob, its_log_prob, rtol=1e-6, atol=1e-6)
    for one, other in zip(ours, its, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-5, atol=1e-5)


def test_densities_stay_numbers_where_the_tanh_is_flat():
    # 1 - tanh(30)^2 is 0 in float32; its logarithm is 2 (ln 2 - 30).
    raw = torch.full((1, 1), 30.0)
    kind = SquashedGaussian(ContinuousActions((-1.0,), (1.0,)))
    log_prob, _ = kind.log_prob_and_entropy(raw, torch.zeros(1), None, raw)
    assert log_prob.item() == pytest.approx(-0.5 * math.log(2 * math.pi) - 2 * (math.log(2) - 30), rel=1e-6)


def test_densities_over_all_actions_sum_to_one():
    action = torch.linspace(-0.9999, 0.9999, 20001, dtype=torch.float64)
    kind = SquashedGaussian(ContinuousActions((-1.0,), (1.0,)))
    log_prob, _ = kind.log_prob_and_entropy(
        torch.full((len(action), 1), 0.3), torch.full((1,), -0.2), None, torch.atanh(action)[:, None]
    )
    assert torch.trapezoid(log_prob.exp(), action).item() == pytest.approx(1.0, abs=2e-3)


def test_the_entropy_estimate_is_right_on_average():
    mean, log_std = torch.full((200_000, 1), 0.4), torch.full((1,), -0.7)
    kind = SquashedGaussian(ContinuousActions((-1.0,), (1.0,)))
    raw, log_prob = kind.sample(mean, log_std, None, torch.Generator().manual_seed(3))
    _, entropy = kind.log_prob_and_entropy(mean, log_std, None, raw)
    assert entropy.mean().item() == pytest.approx(-log_prob.mean().item(), abs=5e-3)


def test_ppo_with_squashed_actions_keeps_within_the_bounds_and_notes_their_density():
    spec = WorldSpec("toy", 4, 1, {"state": ArraySpec((3,), np.float32)}, TWO)
    learner = PpoLearner(spec, NetworkConfig(hidden_units=(8,)), PpoConfig(distribution="squashed"), seed=1)
    with torch.no_grad():
        learner.network.log_std.fill_(2.0)
    seen = np.random.default_rng(0).normal(size=(256, 3)).astype(np.float32)
    decided = learner.act({"state": seen})
    low, high = decided.actions.min(axis=0), decided.actions.max(axis=0)
    assert (low >= TWO.low).all()
    assert (high <= TWO.high).all()
    assert (high - low > 0.9 * np.subtract(TWO.high, TWO.low)).all()
    mean = learner.network.policy({"state": torch.from_numpy(seen)}).detach()
    twin = its_twin(mean.double(), torch.full_like(mean, 2.0).double())
    raw = torch.from_numpy(decided.columns["raw_action"]).double()
    fine = (raw.abs() < 6).all(dim=1)  # beyond, tanh rounds to 1 and the twin loses its way back
    ours = torch.from_numpy(decided.columns["log_prob"]).double()
    torch.testing.assert_close(ours[fine], twin.log_prob(torch.tanh(raw))[fine], rtol=1e-4, atol=1e-4)


def test_numbers_without_bounds_are_refused():
    with pytest.raises(SettingError, match="finite bounds"):
        distribution_for(ContinuousActions((-1.0, -math.inf), (1.0, 1.0)), numbers="squashed")
