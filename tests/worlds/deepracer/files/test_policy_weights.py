"""A policy's weights under AWS's names: which names there are, that all comes back, and what is refused."""

import dataclasses

import numpy as np
import pytest
from tests.worlds.deepracer.files.tiny_policies import CAMERA, LIDAR, numbers_of, tiny_policy

from racecraft.formats.policy_layers import CONTINUOUS, DISCRETE, SAC, DenseLayer, PolicyLayersError
from racecraft.worlds.deepracer.files.policy_weights import arrays_of, is_of_policy, layers_from

PPO, CRITIC = "main_level/agent/main/online/network_1", "main_level/agent/main/online/network_0"
POLICY = "main_level/agent/policy/online/network_0"
STRIDES = {f"{PPO}/{CAMERA}/Conv2d_0/kernel": 30, f"{POLICY}/{CAMERA}/Conv2d_0/kernel": 30}
RESCALER = "gradients_from_head_0-0_rescalers"
SENSORS = {
    f"{CAMERA}/Conv2d_0": ((30, 40, 1, 2), (2,)),
    f"{CAMERA}/Dense_2": ((2, 3), (3,)),  # over each place by itself
    f"{CAMERA}/Dense_4": ((60, 4), (4,)),
    f"{LIDAR}/Dense_0": ((8, 3), (3,)),
    "middleware_fc_embedder/Dense_0": ((7, 6), (6,)),
}
SECOND = {"middleware_fc_embedder/Dense_2": ((6, 7), (7,))}
CRITICS = {f"{CRITIC}/{place}": shapes for place, shapes in (SENSORS | SECOND).items()} | {
    f"{CRITIC}/v_values_head_0/output": ((7, 1), (1,))
}
LAYERS = {
    DISCRETE: {f"{PPO}/{place}": one for place, one in (SENSORS | SECOND).items()}
    | {f"{PPO}/ppo_head_0/policy_fc": ((7, 5), (5,))}
    | CRITICS,
    CONTINUOUS: {f"{PPO}/{place}": one for place, one in (SENSORS | SECOND).items()}
    | {f"{PPO}/ppo_head_0/policy_mean": ((7, 2), (2,))}
    | CRITICS,
    SAC: {f"{POLICY}/{place}": one for place, one in SENSORS.items()}
    | {
        f"{POLICY}/sac_policy_head_0/dense": ((6, 7), (7,)),
        f"{POLICY}/sac_policy_head_0/dense_1": ((7, 2), (2,)),
        f"{POLICY}/sac_policy_head_0/policy_mean": ((7, 2), (2,)),
    },
}
"""Kernels and biases by the names that AWS's trainer gives: every second number, for a layer's activation has one."""
OTHERS = {
    DISCRETE: {f"{PPO}/{RESCALER}": (), f"{CRITIC}/{RESCALER}": ()},
    CONTINUOUS: {f"{PPO}/{RESCALER}": (), f"{CRITIC}/{RESCALER}": (), f"{PPO}/ppo_head_0/policy_log_std": (1, 2)},
    SAC: {f"{POLICY}/{RESCALER}": ()},
}
KINDS = (DISCRETE, CONTINUOUS, SAC)


@pytest.mark.parametrize("kind", KINDS)
def test_a_checkpoint_holds_every_layer_under_awss_name(kind):
    arrays = arrays_of(tiny_policy(kind))
    shapes = {f"{place}/{part}": shape for place, both in LAYERS[kind].items()
              for part, shape in zip(("kernel", "bias"), both, strict=True)}  # fmt: skip
    assert {name: array.shape for name, array in arrays.items()} == shapes | OTHERS[kind]
    assert all(array.dtype == np.float32 and array.flags.c_contiguous for array in arrays.values())
    assert [float(array) for name, array in arrays.items() if name.endswith(RESCALER)] == [1.0] * (2 - (kind == SAC))


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_written_comes_back_critic_and_spread_too(kind):
    policy = tiny_policy(kind)
    back = layers_from(arrays_of(policy), STRIDES)
    assert (back.kind, numbers_of(back.network)) == (kind, numbers_of(policy.network))
    assert [layer.stride for layer in back.network.sensors[0].convolutions] == [30, 1]
    if kind == SAC:
        assert (back.critic, back.log_std) == (None, None)
        np.testing.assert_array_equal(back.log_std_head.kernel, policy.log_std_head.kernel)
    else:
        assert numbers_of(back.critic) == numbers_of(policy.critic), "it moves as the policy does"
        assert (back.log_std is None) is (kind == DISCRETE)
    if kind == CONTINUOUS:
        assert back.log_std.tolist() == policy.log_std.tolist()


def test_a_lidar_without_layers_is_known_by_its_numbers_alone():
    policy = tiny_policy(DISCRETE, lidar_layers=False)
    back = layers_from(arrays_of(policy), STRIDES, lidars={LIDAR: 8})
    assert numbers_of(back.network) == numbers_of(policy.network)
    assert numbers_of(back.critic) == numbers_of(policy.critic)


def test_layers_over_each_place_may_be_all_there_are():
    """Then nothing dense stands behind the flattened picture: 4 x 5 places of 3 numbers, and the LiDAR's 3."""
    arrays = arrays_of(tiny_policy(DISCRETE))
    for scope in (PPO, CRITIC):
        del arrays[f"{scope}/{CAMERA}/Dense_4/kernel"], arrays[f"{scope}/{CAMERA}/Dense_4/bias"]
        arrays[f"{scope}/middleware_fc_embedder/Dense_0/kernel"] = np.zeros((63, 6), np.float32)
    eye = layers_from(arrays, STRIDES).network.sensors[0]
    assert ([layer.kernel.shape for layer in eye.convolutions], eye.dense) == ([(30, 40, 1, 2), (1, 1, 2, 3)], ())


def test_layers_stand_in_the_order_of_their_numbers_not_of_their_names():
    arrays = arrays_of(tiny_policy(DISCRETE))
    middle = f"{PPO}/middleware_fc_embedder"
    for number in (10, 4, 8, 6):
        arrays[f"{middle}/Dense_{number}/kernel"] = np.full((7, 7), number, np.float32)
        arrays[f"{middle}/Dense_{number}/bias"] = np.zeros(7, np.float32)
    arrays[f"{middle}/Dense_12"] = np.zeros(1, np.float32)  # no layer's name
    trunk = layers_from(arrays, STRIDES).network.trunk
    assert [float(layer.kernel[0, 0]) for layer in trunk[2:]] == [4, 6, 8, 10]


@pytest.mark.parametrize("kind", KINDS)
def test_the_slow_copy_of_a_policy_is_not_taken_for_it(kind):
    arrays = arrays_of(tiny_policy(kind))
    copies = {name.replace("/online/", "/an/target/"): array + 1 for name, array in arrays.items()}
    copies |= {name.replace("/online/", "/target/"): array + 1 for name, array in arrays.items()}
    back = layers_from(copies | arrays, STRIDES)
    assert numbers_of(back.network) == numbers_of(tiny_policy(kind).network)


def test_of_many_layers_of_sac_only_the_last_is_in_its_head():
    policy = tiny_policy(SAC)
    first, last = policy.network.trunk
    middle = DenseLayer(np.eye(6, dtype=np.float32), np.zeros(6, np.float32))
    network = dataclasses.replace(policy.network, trunk=(first, middle, last))
    arrays = arrays_of(dataclasses.replace(policy, network=network))
    assert arrays[f"{POLICY}/middleware_fc_embedder/Dense_2/kernel"].tolist() == np.eye(6).tolist()
    assert arrays[f"{POLICY}/sac_policy_head_0/dense/kernel"].tolist() == last.kernel.tolist()
    assert numbers_of(layers_from(arrays, STRIDES).network) == numbers_of(network)


def test_what_an_optimiser_keeps_and_other_networks_are_none_of_the_policy():
    assert is_of_policy(f"{PPO}/ppo_head_0/policy_fc/kernel")
    assert is_of_policy(f"{CRITIC}/v_values_head_0/output/bias")
    for other in ("main_level/agent/main/target/network_1/a/kernel", "main_level/agent/v/online/network_0/a/kernel",
                  f"{PPO}/ppo_head_0/policy_fc/kernel/Adam", f"{PPO}/ppo_head_0/policy_fc/kernel/Adam_1"):  # fmt: skip
        assert not is_of_policy(other)


def zeros(*shape):
    return np.zeros(shape, np.float32)


FC, EYE, MIDDLE = f"{PPO}/ppo_head_0/policy_fc", f"{PPO}/{CAMERA}", f"{PPO}/middleware_fc_embedder"
REFUSED = {
    "no bias": ({f"{MIDDLE}/Dense_2/bias": None}, r"Dense_2: has no bias"),
    "a bias too long": ({f"{MIDDLE}/Dense_0/bias": zeros(7)}, r"kernel has shape \(7, 6\) and bias \(7,\)"),
    "a head of windows": ({f"{FC}/kernel": zeros(1, 1, 7, 5)}, r"policy_fc/kernel has shape .* expected \(inputs, un"),
    "no number": ({f"{EYE}/Conv2d_0/bias": np.array([np.nan, 0], np.float32)}, "no finite numbers"),
    "behind the picture": ({f"{EYE}/Dense_4/kernel": zeros(61, 4)}, f"{CAMERA}: .* reads 61 numbers where 60 arr"),
    "its critic": ({f"{CRITIC}/middleware_fc_embedder/Dense_2/kernel": zeros(5, 7)}, "reads 5 numbers where 6"),
    "a sensor without layers": (
        {f"{PPO}/LEFT_CAMERA/other/kernel": zeros(2)}, r"LEFT_CAMERA: holds no layers; expected convolutions"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_layers_that_do_not_fit_are_refused(case):
    changes, words = REFUSED[case]
    arrays = {name: one for name, one in (arrays_of(tiny_policy(DISCRETE)) | changes).items() if one is not None}
    with pytest.raises(PolicyLayersError, match=words):
        layers_from(arrays, STRIDES)


def test_a_network_whose_strides_nobody_tells_is_refused():
    with pytest.raises(PolicyLayersError, match=r"Conv2d_0: its stride is not known"):
        layers_from(arrays_of(tiny_policy(DISCRETE)), {})


def test_weights_of_something_else_are_refused_with_some_of_their_names():
    with pytest.raises(PolicyLayersError, match=r"weights \(nothing …\)"):
        layers_from({}, {})
    others = {f"{letter}/kernel": zeros(1) for letter in "dcba"}
    with pytest.raises(PolicyLayersError, match=r"weights \(a/kernel, b/kernel, c/kernel …\)"):
        layers_from(others, {})


def test_a_policy_that_sees_nothing_is_refused():
    arrays = {f"{FC}/kernel": zeros(2, 5), f"{FC}/bias": zeros(5), f"{PPO}/other/kernel": zeros(1)}
    with pytest.raises(PolicyLayersError, match=r"network_1: holds no sensor's layers \(other, ppo_head_0\)"):
        layers_from(arrays, {})


def test_a_head_of_sac_without_its_own_layer_is_refused():
    arrays = {name: one for name, one in arrays_of(tiny_policy(SAC)).items() if "/dense" not in name}
    with pytest.raises(PolicyLayersError, match="sac_policy_head_0: holds no dense layer before policy_mean"):
        layers_from(arrays, STRIDES)
