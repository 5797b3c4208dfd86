"""Our Adam beside PyTorch's class of that name, and beside the formula of TensorFlow's."""

import math
import subprocess
import sys

import pytest
import torch
from torch import nn

from racecraft.algorithms.adam import Adam

SHAPES = ((3, 4), (5,), (2, 3, 2, 2))


def parameters():
    chance = torch.Generator().manual_seed(1)
    return [nn.Parameter(torch.randn(shape, generator=chance)) for shape in SHAPES]


def gradients(step):
    chance = torch.Generator().manual_seed(100 + step)
    return [torch.randn(shape, generator=chance) for shape in SHAPES]


def test_its_steps_are_pytorchs_bit_for_bit():
    ours, theirs = parameters(), parameters()
    mine, other = Adam(ours, 1e-2, 1e-5), torch.optim.Adam(theirs, lr=1e-2, eps=1e-5, fused=True)
    for step in range(5):
        for one, twin, gradient in zip(ours, theirs, gradients(step), strict=True):
            one.grad, twin.grad = gradient.clone(), gradient.clone()
        ours[1].grad = theirs[1].grad = None if step < 2 else ours[1].grad  # one begins to learn later
        mine.step()
        other.step()
    assert all((one == twin).all() for one, twin in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("step", [1, 2, 50])
def test_tensorflows_form_adds_epsilon_to_the_raw_root(step):
    """The formula of `tf.train.AdamOptimizer`: lr * sqrt(1 - b2^t) / (1 - b1^t) * m / (sqrt(v) + epsilon)."""
    weight = nn.Parameter(torch.tensor([0.0], dtype=torch.float32))
    optimiser, epsilon, gradient = Adam([weight], 1e-2, 1e-2, "tensorflow"), 1e-2, 0.003
    mean = square = place = 0.0
    for t in range(1, step + 1):
        weight.grad = torch.tensor([gradient])
        optimiser.step()
        mean, square = 0.9 * mean + 0.1 * gradient, 0.999 * square + 0.001 * gradient**2
        rate = 1e-2 * math.sqrt(1.0 - 0.999**t) / (1.0 - 0.9**t)
        place -= rate * mean / (math.sqrt(square) + epsilon)
    assert weight.item() == pytest.approx(place, rel=1e-4)


def test_it_goes_on_from_its_state():
    ours, again = parameters(), parameters()
    optimiser = Adam(ours, 1e-2, 1e-5)
    assert set(optimiser.state_dict()) == {"learning_rate"}, "nothing is remembered of weights that never moved"
    for step in range(3):
        for one, gradient in zip(ours, gradients(step), strict=True):
            one.grad = gradient
        optimiser.step()
    resumed = Adam(again, 1.0, 1e-5)
    resumed.load_state_dict(optimiser.state_dict())
    with torch.no_grad():
        for one, twin in zip(ours, again, strict=True):
            twin.copy_(one)
    for one, twin, gradient in zip(ours, again, gradients(3), strict=True):
        one.grad, twin.grad = gradient.clone(), gradient.clone()
    optimiser.step()
    resumed.step()
    assert all((one == twin).all() for one, twin in zip(ours, again, strict=True))


def test_making_a_learner_and_learning_leaves_pytorchs_compiler_out():
    """It would cost every start more than a second."""
    code = """
import sys, numpy as np, torch
from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
seen = {"eye": ArraySpec((30, 40), np.uint8, 0, 255)}
learner = PpoLearner(WorldSpec("toy", 4, 1, seen, DiscreteActions(3)), NetworkConfig(), PpoConfig(), seed=1)
learner.network.policy({"eye": torch.zeros((2, 30, 40), dtype=torch.uint8)}).sum().backward()
learner.optimiser.step()
print(sorted(name for name in ("torch._dynamo", "sympy") if name in sys.modules))
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


@pytest.mark.parametrize("form", ["paper", "tensorflow"])
def test_a_copy_of_half_the_precision_is_followed_in_one_pass_as_in_four(form):
    torch.manual_seed(1)
    weights = torch.randn(3, 5, 4, 4).to(memory_format=torch.channels_last), torch.randn(5000)
    two = [[nn.Parameter(one.clone(memory_format=torch.preserve_format)) for one in weights] for _ in range(2)]
    halves = [one.detach().bfloat16() for one in two[0]]
    at_once, in_turn = (Adam(those, 1e-2, 1e-5, form) for those in two)
    for _ in range(5):
        pulls = [torch.randn(one.shape).bfloat16() for one in weights]
        for index, (half, pull, other) in enumerate(zip(halves, pulls, two[1], strict=True)):
            half.grad, other.grad = pull, torch.empty_like(other).copy_(pull)
            at_once.step_by_half(index, half)
        in_turn.step()
        for here, there, half in zip(*two, halves, strict=True):
            torch.testing.assert_close(here, there, atol=1e-6, rtol=1e-6)
            assert torch.equal(half, here.detach().bfloat16()), "rounded as PyTorch rounds"
    kept, wanted = at_once.state_dict(), in_turn.state_dict()
    assert kept.keys() == wanted.keys()
    for name, part in wanted.items():
        torch.testing.assert_close(kept[name], part, atol=1e-6, rtol=1e-6)


def test_some_parameters_are_stepped_and_the_others_wait_and_forget_nothing():
    ours, theirs = parameters(), parameters()
    some, every = Adam(ours, 1e-2, 1e-5), Adam(theirs, 1e-2, 1e-5)
    for one, twin, gradient in zip(ours, theirs, gradients(0), strict=True):
        one.grad, twin.grad = gradient.clone(), gradient.clone()
    every.step()
    some.step([2, 0])
    assert torch.equal(ours[1], parameters()[1])
    assert set(some.state_dict()) == {
        "learning_rate",
        *(f"{at}.{part}" for at in (0, 2) for part in ("step", "exp_avg", "exp_avg_sq")),
    }
    some.step([1])
    assert all(torch.equal(one, twin) for one, twin in zip(ours, theirs, strict=True))
    some.step([])
    assert some.state_dict()["1.step"] == 1.0
