"""Curiosity, worked out beside the model: its bonus, its two losses and the step that they make."""

import copy

import numpy as np
import pytest
import torch
from torch.nn import functional

from racecraft.algorithms.curiosity import ActionCode, CuriosityConfig, CuriosityModel
from racecraft.algorithms.networks import Architecture
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
)

SEEN = {"x": ArraySpec((4,), np.float32), "true": ArraySpec((1,), np.float32, privileged=True)}
CHOICES, TICKS = DiscreteActions(3), 5


def model(**settings):
    row = Architecture(trunk_units=(64,), vector_units=(6,), activation="tanh")
    config = CuriosityConfig(**({"strength": 0.7, "units": 8, "batch_size": 2} | settings))
    return CuriosityModel(SEEN, CHOICES, row, config, 1, "cpu")


def ticks():
    rng = np.random.default_rng(2)
    before, after = ({"x": rng.normal(size=(TICKS, 4)).astype(np.float32)} for _ in range(2))
    return before, rng.integers(0, CHOICES.count, TICKS), after


def errors(networks, before, actions, after):
    """Return half the squared error of what is foretold, and the cross-entropy of the action, for each tick."""
    first, then = (networks["features"]({"x": torch.from_numpy(seen["x"])}) for seen in (before, after))
    one_hot = torch.eye(3)[torch.from_numpy(actions)]
    foretold = networks["ahead"](torch.cat([first.detach(), one_hot], dim=1))
    logits = networks["between"](torch.cat([first, then], dim=1))
    wrong = functional.cross_entropy(logits, torch.from_numpy(actions), reduction="none")
    return ((foretold - then.detach()) ** 2).sum(dim=1) / 2, wrong


def test_the_bonus_is_half_the_squared_error_of_what_was_foretold_whatever_the_lots():
    before, actions, after = ticks()
    curious, passes = model(), []
    curious.networks["features"].register_forward_hook(lambda layer, seen, found: passes.append(len(found)))
    found = curious.bonus(before, actions, after)
    expected, _ = errors(curious.networks, before, actions, after)
    assert (found.shape, found.dtype) == ((TICKS,), np.float32)
    np.testing.assert_allclose(found, expected.detach(), rtol=1e-5)
    assert passes[:6] == [2, 2, 2, 2, 1, 1], "two at a time, before and after"


def test_a_step_follows_a_fifth_of_the_forward_loss_and_the_rest_of_the_inverse_one():
    """Pathak et al., 2017, equation 7 with beta 0.2; the forward model's loss teaches the features nothing."""
    before, actions, after = ticks()
    curious = model(batch_size=TICKS, learning_rate=1e-2)
    twin = copy.deepcopy(curious.networks)
    optimiser = torch.optim.Adam(twin.parameters(), 1e-2)
    for _ in range(2):
        optimiser.zero_grad()
        forward, inverse = (part.mean() for part in errors(twin, before, actions, after))
        (0.2 * forward + 0.8 * inverse).backward()
        optimiser.step()
        told = curious.learn(before, actions, after)
    assert list(told) == ["curiosity_forward_loss", "curiosity_inverse_loss"] == list(curious.figures)
    assert list(told.values()) == pytest.approx([forward.item(), inverse.item()], rel=1e-5)
    for mine, its in zip(curious.networks.parameters(), twin.parameters(), strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("actions", "done", "code"),
    [
        (DiscreteActions(3), [1], [0, 1, 0]),
        (MultiDiscreteActions((2, 3)), [1, 2], [0, 1, 0, 0, 1]),
        (ContinuousActions((-2.0, 0.0), (4.0, 1.0)), [4.0, 0.5], [1.0, 0.0]),
        (HybridActions(ContinuousActions((0.0,), (8.0,)), MultiDiscreteActions((2,))), [2.0, 1.0], [-0.5, 0.0, 1.0]),
    ],
)
def test_actions_of_every_kind_become_shares_of_their_bounds_and_ones(actions, done, code):
    coded = ActionCode(actions)
    found = coded.encoded(torch.tensor([done, done]))
    assert coded.width == len(code)
    assert found.dtype == torch.float32
    assert found.tolist() == [code, code]


def test_guesses_of_numbers_are_wrong_by_their_mean_square_and_of_choices_by_their_surprise():
    numbers = ActionCode(ContinuousActions((-2.0, 0.0), (4.0, 1.0)))
    wrong = numbers.error(torch.tensor([[0.0, 0.0], [1.0, 3.0]]), torch.tensor([[4.0, 0.5], [4.0, 0.5]]))
    assert wrong.tolist() == [0.5, 4.5], "(1 + 0) / 2 and (0 + 9) / 2"
    choices = ActionCode(MultiDiscreteActions((2, 3)))
    told = torch.tensor([[0.0, 0.0, 1.0, 2.0, 3.0]])
    done = torch.tensor([[1, 2]])
    expected = np.log(2) - np.log(np.exp(3) / (np.exp(1) + np.exp(2) + np.exp(3)))
    assert choices.error(told, done).item() == pytest.approx(expected)
