"""Choices and numbers drawn, told and bounded: beside PyTorch's own distributions, and by hand."""

import math

import numpy as np
import pytest
import torch
from torch import distributions as theirs

from racecraft.algorithms.distributions import (
    SQUASHED,
    Categorical,
    DiagGaussian,
    Hybrid,
    MultiCategorical,
    SquashedGaussian,
    distribution_for,
    numbers_width,
    params_width,
)
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
)

R = 6
CHOICE, BRANCHES = DiscreteActions(3), MultiDiscreteActions((3, 2))
NUMBERS = ContinuousActions((-2.0, 0.0), (4.0, 1.0))
BOTH = HybridActions(NUMBERS, BRANCHES)


def chance(seed=1):
    return torch.Generator().manual_seed(seed)


def params(width, seed=3):
    return torch.randn((R, width), generator=chance(seed))


def test_a_choice_is_as_likely_and_as_undecided_as_pytorch_says():
    logits, ours = params(3), Categorical(CHOICE)
    twin = theirs.Categorical(logits=logits)
    given = torch.tensor([0, 1, 2, 2, 1, 0])
    log_prob, entropy = ours.log_prob_and_entropy(logits, None, None, given)
    torch.testing.assert_close(log_prob, twin.log_prob(given))
    torch.testing.assert_close(entropy, twin.entropy())
    drawn, drawn_log_prob = ours.sample(logits, None, None, chance())
    assert (drawn.shape, drawn.dtype) == ((R,), torch.int64)
    torch.testing.assert_close(drawn_log_prob, twin.log_prob(drawn))
    best, best_log_prob = ours.mode(logits, None, None)
    assert torch.equal(best, logits.argmax(dim=1))
    torch.testing.assert_close(best_log_prob, twin.log_prob(best))
    torch.testing.assert_close(ours.probabilities(logits, None), twin.probs)
    assert ours.to_actions(drawn) is drawn


def test_choices_are_drawn_as_often_as_they_are_likely():
    shares = torch.tensor([0.5, 0.3, 0.2])
    drawn, _ = Categorical(CHOICE).sample(shares.log().expand(20_000, 3), None, None, chance())
    np.testing.assert_allclose(np.bincount(drawn) / 20_000, shares, atol=0.01)


def test_what_is_forbidden_is_impossible_and_leaves_all_numbers_finite():
    mask = torch.tensor([[True, False, True]])
    ours, logits = Categorical(CHOICE), torch.tensor([[0.0, 50.0, 0.0]])
    assert ours.probabilities(logits, mask).tolist() == [[0.5, 0.0, 0.5]]
    log_prob, entropy = ours.log_prob_and_entropy(logits, None, mask, torch.tensor([2]))
    assert (log_prob.item(), entropy.item()) == pytest.approx((math.log(0.5), math.log(2)))
    assert ours.log_prob_and_entropy(logits, None, mask, torch.tensor([1]))[0].item() == pytest.approx(-1e9)
    assert set(ours.sample(logits.expand(200, 3), None, mask.expand(200, 3), chance())[0].tolist()) == {0, 2}


def test_a_floor_lifts_what_is_less_likely_and_lowers_nothing_else():
    """Facts: Coach's `ppo_head.py` adds to the small ones and does not take it from the others."""
    logits = torch.tensor([[0.5, 0.45, 0.05]]).log()
    ours = Categorical(CHOICE, floor=0.1)
    torch.testing.assert_close(ours.probabilities(logits, None), torch.tensor([[0.5, 0.45, 0.1]]))
    mask = torch.tensor([[True, True, False]])
    torch.testing.assert_close(ours.probabilities(logits, mask), torch.tensor([[0.5, 0.45, 0.0]]) / 0.95)
    torch.testing.assert_close(Categorical(CHOICE).probabilities(logits, None), logits.exp())


@pytest.mark.parametrize("mask", [None, [True, False, True]])
def test_who_draws_greedily_wanders_by_epsilon_among_what_is_allowed(mask):
    logits = torch.tensor([[0.1, 0.2, 0.7]]).log().expand(8000, 3)
    masks = None if mask is None else torch.tensor([mask]).expand(8000, 3)
    drawn, log_prob = Categorical(CHOICE).sample_greedily(logits, masks, 0.3, chance())
    allowed = np.ones(3) / 3 if mask is None else np.array([0.5, 0.0, 0.5])
    np.testing.assert_allclose(np.bincount(drawn, minlength=3) / 8000, 0.7 * np.eye(3)[2] + 0.3 * allowed, atol=0.02)
    likely = np.array([0.1, 0.2, 0.7]) if mask is None else np.array([0.125, 0.0, 0.875])
    np.testing.assert_allclose(log_prob.exp(), likely[drawn], rtol=1e-5)
    never, _ = Categorical(CHOICE).sample_greedily(logits, masks, 0.0, chance())
    assert (never == 2).all()


def test_branches_are_drawn_side_by_side_and_their_likelihoods_multiply():
    logits, ours = params(5), MultiCategorical(BRANCHES)
    twins = [theirs.Categorical(logits=part) for part in logits.split([3, 2], dim=1)]
    given = torch.tensor([[2, 1], [0, 0], [1, 1], [2, 0], [0, 1], [1, 0]])
    log_prob, entropy = ours.log_prob_and_entropy(logits, None, None, given)
    torch.testing.assert_close(log_prob, twins[0].log_prob(given[:, 0]) + twins[1].log_prob(given[:, 1]))
    torch.testing.assert_close(entropy, twins[0].entropy() + twins[1].entropy())
    for told, (actions, log_prob) in {
        "drawn": ours.sample(logits, None, None, chance()), "likeliest": ours.mode(logits, None, None),
    }.items():  # fmt: skip
        assert (actions.shape, actions.dtype) == ((R, 2), torch.int64), told
        torch.testing.assert_close(log_prob, ours.log_prob_and_entropy(logits, None, None, actions)[0])
    assert torch.equal(ours.mode(logits, None, None)[0][:, 1], logits[:, 3:].argmax(dim=1))
    assert ours.to_actions(given) is given


def test_each_branch_heeds_its_own_part_of_a_mask_and_the_floor():
    mask = torch.tensor([[True, False, False, False, True]]).expand(R, 5)
    ours = MultiCategorical(BRANCHES)
    for actions, log_prob in (ours.sample(params(5), None, mask, chance()), ours.mode(params(5), None, mask)):
        assert actions.tolist() == [[0, 1]] * R
        assert log_prob.tolist() == [0.0] * R
    logits, rare = torch.tensor([[5.0, 0.0, 0.0, 0.0, 0.0]]), torch.tensor([[1, 1]])
    log_prob, _ = MultiCategorical(BRANCHES, floor=0.25).log_prob_and_entropy(logits, None, None, rare)
    assert log_prob.exp().item() == pytest.approx(0.25 * 0.5)


@pytest.mark.parametrize("of_each_row", [False, True])
def test_numbers_are_as_dense_and_as_undecided_as_pytorch_says(of_each_row):
    mean, log_std = params(2), torch.tensor([-0.5, 0.3])
    log_std = log_std + 0.1 * params(2, seed=5) if of_each_row else log_std
    ours, twin = DiagGaussian(NUMBERS), theirs.Independent(theirs.Normal(mean, log_std.exp()), 1)
    drawn, log_prob = ours.sample(mean, log_std, None, chance())
    noise = torch.randn((R, 2), generator=chance())
    torch.testing.assert_close(drawn, mean + log_std.exp() * noise)
    torch.testing.assert_close(log_prob, twin.log_prob(drawn))
    told, entropy = ours.log_prob_and_entropy(mean, log_std, None, drawn)
    torch.testing.assert_close(told, log_prob)
    torch.testing.assert_close(entropy, twin.entropy())
    argmax_action, at_most = ours.mode(mean, log_std, None)
    assert argmax_action is mean
    torch.testing.assert_close(at_most, twin.log_prob(mean))


def test_a_standard_deviation_is_held_between_e_to_the_minus_20_and_e_to_the_3():
    """Facts: Coach's `ppo_head.py` clips its logarithm to -20 and 3."""
    ours, nothing = DiagGaussian(ContinuousActions((-1.0,), (1.0,))), torch.zeros(1, 1)
    for asked, held in ((-30.0, -20.0), (10.0, 3.0), (-19.5, -19.5), (2.5, 2.5)):
        _, entropy = ours.log_prob_and_entropy(nothing, torch.tensor([asked]), None, nothing)
        assert entropy.item() == pytest.approx(held + 0.5 * math.log(2 * math.pi * math.e), rel=1e-6)


def test_numbers_are_cut_and_stretched_to_their_bounds_and_pass_where_there_are_none():
    infinite = math.inf
    ours = DiagGaussian(ContinuousActions((-2.0, -infinite, 0.0, -infinite), (4.0, infinite, infinite, 1.0)))
    raw = torch.tensor([[0.5, 7.0, 5.0, -9.0], [3.0, -7.0, -3.0, 2.0], [-3.0, 0.0, 0.25, 0.5], [0.0, 1.5, 0.0, 0.0]])
    told = [[2.5, 7.0, 5.0, -9.0], [4.0, -7.0, 0.0, 1.0], [-2.0, 0.0, 0.25, 0.5], [1.0, 1.5, 0.0, 0.0]]
    assert ours.to_actions(raw).tolist() == told


@pytest.mark.parametrize("numbers", ["gaussian", SQUASHED])
def test_numbers_and_choices_at_once_are_the_two_side_by_side(numbers):
    given, log_std = params(7), torch.tensor([-0.5, 0.3])
    ours = Hybrid(BOTH, 0.0, numbers)
    gaussian, choices = type(ours.numbers)(NUMBERS), MultiCategorical(BRANCHES)
    assert isinstance(ours.numbers, SquashedGaussian) is (numbers == SQUASHED)
    shared = chance()
    drawn, density = gaussian.sample(given[:, :2], log_std, None, shared)
    chosen, log_prob = choices.sample(given[:, 2:], None, None, shared)
    raw, told = ours.sample(given, log_std, None, chance())
    assert torch.equal(raw, torch.cat([drawn, chosen.float()], dim=1))
    torch.testing.assert_close(told, density + log_prob)
    again, entropy = ours.log_prob_and_entropy(given, log_std, None, raw)
    torch.testing.assert_close(again, told)
    spread = gaussian.log_prob_and_entropy(given[:, :2], log_std, None, drawn)[1]
    torch.testing.assert_close(entropy, spread + choices.log_prob_and_entropy(given[:, 2:], None, None, chosen)[1])
    argmax_action, at_most = ours.mode(given, log_std, None)
    assert torch.equal(argmax_action[:, :2], given[:, :2])
    assert torch.equal(argmax_action[:, 2:].long(), choices.mode(given[:, 2:], None, None)[0])
    torch.testing.assert_close(at_most, ours.log_prob_and_entropy(given, log_std, None, argmax_action)[0])
    assert torch.equal(ours.to_actions(raw), torch.cat([gaussian.to_actions(drawn), chosen.float()], dim=1))


def test_a_mask_of_numbers_and_choices_is_one_of_the_choices():
    mask = torch.tensor([[False, False, True, True, False]]).expand(R, 5)
    ours, log_std = Hybrid(BOTH), torch.zeros(2)
    for raw, _ in (ours.sample(params(7), log_std, mask, chance()), ours.mode(params(7), log_std, mask)):
        assert raw[:, 2:].tolist() == [[2.0, 0.0]] * R
    log_prob, _ = ours.log_prob_and_entropy(params(7), log_std, mask, raw)
    bare, _ = DiagGaussian(NUMBERS).log_prob_and_entropy(params(7)[:, :2], log_std, None, raw[:, :2])
    torch.testing.assert_close(log_prob, bare)


@pytest.mark.parametrize(
    ("actions", "kind", "width", "numbers"),
    [
        (CHOICE, Categorical, 3, 0),
        (BRANCHES, MultiCategorical, 5, 0),
        (NUMBERS, DiagGaussian, 2, 2),
        (BOTH, Hybrid, 7, 2),
    ],
)
def test_every_kind_of_action_has_its_distribution_and_so_many_parameters(actions, kind, width, numbers):
    ours = distribution_for(actions)
    assert (type(ours), ours.spec) == (kind, actions)
    assert (params_width(actions), numbers_width(actions)) == (width, numbers)
    assert isinstance(distribution_for(BOTH, numbers=SQUASHED).numbers, SquashedGaussian)


def test_one_policy_does_not_act_for_several_kinds_of_agents():
    with pytest.raises(SettingError, match="expected one for each group"):
        distribution_for(GroupedActions(3))
