"""The greedy policy of an actor network: what it is made of, and what it says of choices."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.actor_policy import actor_critic_class, load_actor_policy
from racecraft.algorithms.architecture import Architecture
from racecraft.algorithms.distributions import SQUASHED, SquashedGaussian
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions

SEEN = {"x": ArraySpec((3,), np.float32)}
ROW = Architecture(trunk_units=(6,), activation="tanh")
NUMBERS = ContinuousActions((-1.0, 0.0), (1.0, 4.0))


def network(actions, row=ROW):
    made = actor_critic_class(row)(SEEN, actions, row, torch.Generator().manual_seed(1))
    with torch.no_grad():
        for one in made.parameters():
            torch.nn.init.normal_(one, generator=torch.Generator().manual_seed(one.numel()))
    return made


def seen(rows=20):
    return {"x": np.random.default_rng(1).normal(size=(rows, 3)).astype(np.float32)}


def loaded(actions, row=ROW, **more):
    spec = PolicySpec("ppo", SEEN, actions, {**architecture_values(row), **more})
    return load_actor_policy(spec, network(actions, row).state_dict())


@pytest.mark.parametrize("masked", [False, True])
def test_choices_are_told_with_their_chances_and_with_what_the_critic_expects(masked):
    one, policy, rows = network(DiscreteActions(3)), loaded(DiscreteActions(3)), seen()
    mask = np.ones((20, 3), bool)
    mask[np.arange(20), np.arange(20) % 3] = not masked
    logits, values = one({"x": torch.from_numpy(rows["x"])})
    chances = torch.softmax(logits.masked_fill(~torch.from_numpy(mask), -torch.inf), dim=1).detach().numpy()
    given = mask if masked else None
    np.testing.assert_allclose(policy.probabilities(rows, given), chances, atol=1e-6)
    np.testing.assert_array_equal(policy.act(rows, given), chances.argmax(axis=1))
    told, expected = policy.evaluate(rows, given)
    np.testing.assert_allclose(told, chances, atol=1e-6)
    np.testing.assert_allclose(expected, values.detach().numpy(), rtol=1e-5)
    many = {"x": np.repeat(rows["x"][:1], 4000, axis=0)}
    drawn = policy.sample(many, np.repeat(mask[:1], 4000, axis=0) if masked else None, torch.Generator().manual_seed(1))
    np.testing.assert_allclose(np.bincount(drawn, minlength=3) / 4000, chances[0], atol=0.03)


def test_a_policy_of_a_file_has_the_floor_and_the_kind_of_numbers_that_it_names_and_else_none():
    plain = loaded(DiscreteActions(3)).probabilities(seen())
    assert plain.min() < 0.05
    np.testing.assert_allclose(
        loaded(DiscreteActions(3), probability_floor=0.05).probabilities(seen()), np.maximum(plain, 0.05), rtol=1e-5
    )
    one = network(NUMBERS)
    mean = one.policy({"x": torch.from_numpy(seen()["x"])}).detach()
    cut, bent = mean.clamp(-1, 1), torch.tanh(mean)
    for policy, expected in ((loaded(NUMBERS), cut), (loaded(NUMBERS, distribution=SQUASHED), bent)):
        stretched = expected * torch.tensor([1.0, 2.0]) + torch.tensor([0.0, 2.0])
        np.testing.assert_allclose(policy.act(seen()), stretched, atol=1e-5)
    assert isinstance(loaded(NUMBERS, distribution=SQUASHED).distribution, SquashedGaussian)
