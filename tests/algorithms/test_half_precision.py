"""A copy in bfloat16 beside the float32 network that is optimised."""

import copy

import numpy as np
import pytest
import torch

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.half_precision import Bfloat16Copy, processor_precision
from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.contract.world import ArraySpec, DiscreteActions

SEEN = {"x": ArraySpec((5,), np.float32)}


def network(**row):
    settings = {"trunk_units": (6,), "activation": "tanh"} | row
    return ActorCritic(SEEN, DiscreteActions(3), Architecture(**settings), torch.Generator().manual_seed(1))


@pytest.mark.parametrize(
    ("told", "precision"),
    [
        ({}, "float32"),
        ({"avx512_bf16": False, "amx_bf16": False}, "float32"),
        ({"avx512_bf16": True, "amx_bf16": False}, "bfloat16"),
        ({"amx_bf16": True}, "bfloat16"),
    ],
)
def test_auto_is_what_the_processor_multiplies_by_itself_and_what_is_named_stays(told, precision, monkeypatch):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: told, raising=False)
    assert processor_precision("auto") == precision
    assert (processor_precision("bfloat16"), processor_precision("float32")) == ("bfloat16", "float32")


def test_a_torch_that_cannot_say_multiplies_in_float32(monkeypatch):
    monkeypatch.delattr(torch.cpu, "get_capabilities", raising=False)
    assert processor_precision("auto") == "float32"


@pytest.mark.parametrize("apart", [False, True])
def test_bodies_are_halved_and_heads_are_the_others_own(apart):
    whole = network(separate_networks=apart)
    half = Bfloat16Copy(whole).network
    assert {one.dtype for one in half.policy_body.parameters()} == {torch.bfloat16}
    assert {one.dtype for one in whole.parameters()} == {torch.float32}
    assert half.policy_head is whole.policy_head
    assert half.value_head is whole.value_head
    assert (half.critic_body is None) is not apart
    if apart:
        assert {one.dtype for one in half.critic_body.parameters()} == {torch.bfloat16}
    seen = {"x": torch.randn((7, 5), generator=torch.Generator().manual_seed(2))}
    for found, wanted in zip(half(seen), whole(seen), strict=True):
        assert found.dtype == torch.float32
        torch.testing.assert_close(found, wanted, atol=0.05, rtol=0.05)


def test_what_the_copy_finds_is_handed_over_and_what_it_does_not_is_taken_away():
    whole = network()
    twin = Bfloat16Copy(whole)
    layer, copied = whole.policy_body.trunk[0], twin.network.policy_body.trunk[0]
    copied.weight.grad = torch.full_like(copied.weight, 0.5)
    layer.bias.grad = torch.ones_like(layer.bias)
    twin.hand_over()
    assert layer.weight.grad.dtype == torch.float32
    assert (layer.weight.grad == 0.5).all()
    assert layer.bias.grad is None, "the copy found none"
    place = layer.weight.grad
    copied.weight.grad.fill_(0.25)
    twin.hand_over()
    assert layer.weight.grad is place, "written where the last one lay"
    assert (place == 0.25).all()


def pulled(whole, twin):
    """Give everything that learns a gradient of its own."""
    chance = torch.Generator().manual_seed(3)
    for one in twin.network.parameters():
        one.grad = torch.randn(one.shape, generator=chance).to(one.dtype)
    for one in whole.policy_body.parameters():
        one.grad = torch.full_like(one, 1e6)  # a stale one of the whole network counts for nothing


@pytest.mark.parametrize("part", [None, (1, 2)])
def test_a_step_is_that_of_handing_over_stepping_and_refreshing(part):
    one, other = network(), network()
    mine, its = Bfloat16Copy(one), Bfloat16Copy(other)
    optimiser, twin_optimiser = (Adam(net.parameters(), 1e-2, 1e-5) for net in (one, other))
    before = copy.deepcopy(one.state_dict())
    pulled(one, mine)
    pulled(other, its)
    mine.step(optimiser, part)
    its.hand_over()
    twin_optimiser.step(part)
    its.refresh()
    for index, ((name, found), wanted) in enumerate(zip(one.named_parameters(), other.parameters(), strict=True)):
        torch.testing.assert_close(found, wanted, rtol=1e-5, atol=1e-6, msg=name)
        assert torch.equal(found, before[name]) is (part is not None and index not in part), name
    if part is None:
        for found, wanted in zip(mine.network.parameters(), its.network.parameters(), strict=True):
            torch.testing.assert_close(found, wanted, rtol=1e-2, atol=1e-2)
            assert found.dtype == wanted.dtype
