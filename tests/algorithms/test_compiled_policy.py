"""One look of a small plain network: its room by hand, and by twin with PyTorch."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.compiled_policy import CompiledPolicy, Layer, compile_policy, end_to_end
from racecraft.algorithms.kernels.greedy_action import NO_BEND, argmax_action
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

FRAME = (7, 9)
SMALL = {"conv_filters": (3, 4), "conv_kernels": (3, 2), "conv_strides": (2, 1), "hidden_units": (6,)}


def layer(size, seen, filters, stride=1, bend=NO_BEND, seed=1):
    chance = np.random.default_rng(seed)
    weight = chance.normal(size=(size, size, seen, filters)).astype(np.float32)
    return Layer(weight, chance.normal(size=filters).astype(np.float32), stride, bend)


def looked(look, frame):
    """Return the choice, and the numbers it was chosen by: the two maps are written in turn."""
    buffer = np.full((3, look.buffer_size), 7.0, np.float32)
    choice = argmax_action(look.layers, look.weights, look.scale, frame, buffer)
    return choice, buffer[len(look.layers) % 2, : look.layers[-1, 6]]


def test_of_equals_the_first_is_taken_and_any_may_be_the_likeliest():
    for biases, best in (([1, 1, 1], 0), ([0, 2, 2], 1), ([0, 1, 2], 2), ([-1, -3, -2], 0)):
        head = Layer(np.zeros((1, 1, 63, 3), np.float32), np.float32(biases), 1, NO_BEND)
        assert looked(end_to_end([head], (*FRAME, 1)), np.zeros(FRAME, np.uint8))[0] == best


@pytest.mark.parametrize(
    ("layers", "shape", "buffer"),
    [
        ([layer(2, 1, 20), layer(1, 180, 2)], (4, 4, 1), 180),  # a map of 3 x 3 x 20
        ([layer(1, 1, 30), layer(4, 30, 2)], (4, 4, 1), 480),  # a kernel over 4 x 4 x 30, as large as that map
        ([layer(2, 9, 2)], (2, 3, 9), 36),  # a kernel over 2 x 2 x 9; the frame counts as one of grey
        ([layer(1, 16, 50)], (4, 4, 1), 50),
    ],
)
def test_there_is_room_for_the_widest_map_and_kernel(layers, shape, buffer):
    assert end_to_end(layers, shape).buffer_size == buffer


def learner_of(seen=None, actions=None, **network):
    seen = seen or {"eye": ArraySpec(FRAME, np.uint8)}
    spec = WorldSpec("toy", 1, 1, seen, actions or DiscreteActions(5))
    return PpoLearner(spec, NetworkConfig(**{**SMALL, **network}), PpoConfig(), seed=3)


FLAT = {"conv_filters": (), "conv_kernels": (), "conv_strides": ()}


@pytest.mark.parametrize("network", [{}, {"activation": "tanh"}, {"image_units": (5,)}, FLAT])
def test_a_look_gives_what_pytorch_gives(network):
    learner = learner_of(**network)
    for part in learner.network.parameters():
        torch.nn.init.normal_(part, std=0.4, generator=torch.Generator().manual_seed(1))
    look = learner.compile_policy("eye", FRAME)
    for seed in range(3):
        frame = np.random.default_rng(seed).integers(0, 256, FRAME).astype(np.uint8)
        choice, numbers = looked(look, frame)
        with torch.no_grad():
            expected = learner.network.policy({"eye": torch.from_numpy(frame)[None]})[0]
        np.testing.assert_allclose(numbers, expected, rtol=1e-3, atol=1e-4)
        assert choice == learner.choose({"eye": frame[None]})[0]


def test_weights_are_copies():
    learner = learner_of()
    look = learner.compile_policy("eye", FRAME)
    before = look.weights.copy()
    with torch.no_grad():
        for part in learner.network.parameters():
            part.add_(1.0)
    np.testing.assert_array_equal(look.weights, before)


def test_only_one_choice_over_one_grey_frame_is_looked_at_so():
    eye, other = ArraySpec(FRAME, np.uint8), ArraySpec((2,), np.float32)
    assert isinstance(learner_of().compile_policy("eye", FRAME), CompiledPolicy)
    assert learner_of().compile_policy("front", FRAME) is None
    assert learner_of({"eye": eye, "state": other}).compile_policy("eye", FRAME) is None
    assert learner_of({"eye": ArraySpec((*FRAME, 2), np.uint8)}).compile_policy("eye", (*FRAME, 2)) is None
    assert learner_of({"eye": other}).compile_policy("eye", (2,)) is None
    assert learner_of(actions=ContinuousActions((-1.0,), (1.0,))).compile_policy("eye", FRAME) is None
    hidden = {"eye": eye, "truth": ArraySpec((2,), np.float32, privileged=True)}
    assert learner_of(hidden).compile_policy("eye", FRAME) is not None  # the policy sees one frame all the same
    recurrent = learner_of(memory="gru", memory_units=3)
    assert compile_policy(recurrent.network, recurrent.distribution, "eye", FRAME) is None
