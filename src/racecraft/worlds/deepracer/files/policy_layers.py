"""The names that AWS's trainer gave the weights of a policy's layers (`formats/policy_layers.py`).

Every layer of AWS's networks is counted together with the non-linearity behind it, so numbers go up by two::

    main_level/agent/main/online/network_1/            PPO's policy; network_0 beside it is the critic
        FRONT_FACING_CAMERA/Conv2d_0/kernel  …/bias    convolutions of a sensor, then its dense layers (Dense_6 …)
        middleware_fc_embedder/Dense_0/kernel          over all sensors together, laid end to end by their sorted names
        ppo_head_0/policy_fc/kernel                    choices; policy_mean and policy_log_std for two ranges
    main_level/agent/policy/online/network_0/
        sac_policy_head_0/dense/kernel  policy_mean    SAC's: one more dense layer within the head

A dense layer that AWS put behind convolutions works on each place of the picture by itself, for nothing was flattened
yet: it is a convolution of one pixel, and is one here.

Source: facts: deepracer.md 8.2, deepracer-systems.md B8; names from a `.meta` file that AWS's console wrote in 2023;
Coach `embedder.py` (flattens last), `ppo_head.py`; simapp `sac_head.py`, `custom_architectures.py`.
"""

from __future__ import annotations

from collections.abc import Mapping

from racecraft.formats.policy_layers import (
    CONTINUOUS,
    DISCRETE,
    SAC,
    DenseLayer,
    PolicyLayers,
    PolicyLayersError,
    is_pixel,
)

POLICY_SCOPES = {
    DISCRETE: "main_level/agent/main/online/network_1",
    CONTINUOUS: "main_level/agent/main/online/network_1",
    SAC: "main_level/agent/policy/online/network_0",
}
INPUT_SCOPES = {kind: scope.replace("network_1", "network_0") for kind, scope in POLICY_SCOPES.items()}
"""Where the placeholders stand: the first network makes them, the second reads them."""
HEADS = {DISCRETE: "ppo_head_0", CONTINUOUS: "ppo_head_0", SAC: "sac_policy_head_0"}
LAST_LAYERS = {DISCRETE: "policy_fc", CONTINUOUS: "policy_mean", SAC: "policy_mean"}
MIDDLEWARE = "middleware_fc_embedder"
VALUE_SCOPE = "main_level/agent/main/online/network_0"
VALUE_LAYER = "v_values_head_0/output"
LIDAR_UNITS = (256, 256)
"""Dense layers over any LiDAR."""
RESCALER = "gradients_from_head_0-0_rescalers"
"""A number beside each network: 1, as no head's gradient is rescaled."""
KNOWN_STRIDES: Mapping[tuple[tuple[int, int], ...], tuple[int, ...]] = {
    ((8, 32), (4, 64), (3, 64)): (4, 2, 1),
    ((5, 32), (3, 32), (3, 64), (3, 64)): (2, 1, 2, 1),
    ((8, 32), (4, 32), (4, 64), (3, 64)): (4, 2, 2, 1),
    ((3, 32), (3, 64), (3, 64), (3, 128), (3, 128)): (1, 2, 1, 2, 1),
}
"""Strides of AWS's networks by the (kernel, filters) of their convolutions, where no graph tells them."""


def require_aws_network(policy: PolicyLayers) -> None:
    """Refuse what AWS's trainer could not go on with.

    Raises:
        PolicyLayersError: The message says what of it.
    """
    if policy.kind == SAC:
        raise PolicyLayersError(
            "the policy was learned by sac, whose critics are others at AWS; expected one of ppo. --to car takes it."
        )
    if policy.critic is None:
        raise PolicyLayersError(
            "it has no critic of its own that sees what the policy sees; expected one of ppo with "
            "network.privileged_critic=false and network.separate_networks=true, as the preset aws has. --to car takes "
            "it as it is."
        )
    for sensor in policy.network.sensors:
        row = tuple(
            (layer.kernel.shape[0], layer.kernel.shape[3]) for layer in sensor.convolutions if not is_pixel(layer)
        )
        dense = tuple(layer.kernel.shape[1] for layer in sensor.dense)
        is_known = row in KNOWN_STRIDES and not dense if sensor.is_image else dense == LIDAR_UNITS
        if sensor.shrink != 1 or not is_known:
            raise PolicyLayersError(
                "its network for {name} is none of AWS's three, or sees smaller frames; expected one that was "
                "trained with --preset aws. --to car takes it as it is.",
                name=sensor.name,
            )


def head_layers(policy: PolicyLayers) -> tuple[tuple[DenseLayer, ...], tuple[DenseLayer, ...]]:
    """Return the trunk's layers that AWS keeps in the middleware, and those it keeps in the head (SAC's last)."""
    trunk = policy.network.trunk
    return (trunk[:-1], trunk[-1:]) if policy.kind == SAC else (trunk, ())
