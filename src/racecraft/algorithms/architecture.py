"""A network as settings and as a row of figures; nothing here needs torch. Begin with `Architecture`.

`networks.py` builds what the row says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.settings.table import check_group, setting

NONE, LSTM, GRU = "none", "lstm", "gru"
"""What a policy may carry from tick to tick."""


@dataclass(frozen=True)
class NetworkConfig:
    """The policy's and the critic's network."""

    conv_filters: tuple[int, ...] = setting((16, 32), "Filters of each convolution.", low=1)
    conv_kernels: tuple[int, ...] = setting((6, 4), "Kernel size of each convolution.", unit="px", low=1)
    conv_strides: tuple[int, ...] = setting((3, 2), "Stride of each convolution.", unit="px", low=1)
    image_units: tuple[int, ...] | None = setting(
        None, "Units of each dense layer between an image's convolutions and what all observations share.", low=1
    )
    vector_units: tuple[int, ...] | None = setting(
        None, "Units of each dense layer between a vector, such as a LiDAR's, and what all observations share.", low=1
    )
    hidden_units: tuple[int, ...] = setting((128,), "Units of each dense layer.", low=1)
    activation: str = setting("relu", "Non-linearity between layers.", choices=("relu", "tanh"))
    privileged_critic: bool = setting(
        True, "While training, the critic sees the true state the world offers; the policy never does."
    )
    separate_networks: bool = setting(False, "Whether a critic without privileges shares nothing with the policy.")
    initialisation: str = setting(
        "orthogonal", "How the first weights are drawn; biases start at 0.", choices=("orthogonal", "glorot")
    )
    encoder: str | None = setting(
        None, "Your own network as module:Class in place of the layers above; the heads stay."
    )
    policy: str | None = setting(
        None, "Your own network as module:Class in place of layers and heads: it decides and values by itself."
    )
    normalise: bool = setting(
        False, "Whether vectors are scaled by their running mean and deviation, which are kept beside the weights."
    )
    stack_size: int = setting(
        1, "How many of the latest observations the policy sees at once: images along their channels.", low=1, high=64
    )
    memory: str = setting(
        "none",
        "What the policy carries from tick to tick, behind its layers; with PPO.",
        choices=("none", "lstm", "gru"),
    )
    memory_units: int = setting(128, "Units of that memory.", low=1)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class Architecture:
    """A network as a row of figures."""

    convolutions: tuple[tuple[int, int, int], ...] = ()
    """(filters, kernel px, stride px) of each convolution over an image; no padding."""
    image_units: tuple[int, ...] = ()
    """Dense layers of an image's own, after its convolutions."""
    vector_units: tuple[int, ...] = ()
    """Dense layers of a vector's own, before it meets the others."""
    trunk_units: tuple[int, ...] = (64, 64)
    """Dense layers over everything together."""
    activation: str = "relu"
    """`relu` or `tanh`, after every layer but the heads."""
    separate_networks: bool = False
    """Whether policy and critic share nothing."""
    privileged_critic: bool = True
    """Whether the critic may read what the world marks as privileged."""
    initialisation: str = "orthogonal"
    """`orthogonal`, or `glorot`: as the AWS networks start, Glorot uniform and normalised columns for the last layers
    of critic and commands (facts: Coach `ppo_head.py`, `v_head.py`)."""
    encoder: str | None = None
    """A user's own network as "module:Class", instead of convolutions and dense layers; None: those."""
    policy: str | None = None
    """A user's own network as "module:Class", instead of layers and heads; None: those."""
    normalise: bool = False
    """Whether vectors are scaled by their running mean and deviation."""
    memory: str = "none"
    """`none`, `lstm` or `gru`: what is carried from tick to tick behind the trunk (`recurrent_network.py`)."""
    memory_units: int = 0


def architecture_of(config: NetworkConfig) -> Architecture:
    """Return the row that the settings describe.

    Raises:
        SettingError: The three lists of convolutions differ in length.
    """
    counts = len(config.conv_filters), len(config.conv_kernels), len(config.conv_strides)
    if len(set(counts)) > 1:
        raise SettingError(
            "network.conv_filters, conv_kernels and conv_strides have {counts}, {counts_2} and {counts_3} "
            "entries; expected one of each for every convolution.",
            counts=counts[0],
            counts_2=counts[1],
            counts_3=counts[2],
        )
    return Architecture(
        convolutions=tuple(zip(config.conv_filters, config.conv_kernels, config.conv_strides, strict=True)),
        image_units=config.image_units or (),
        vector_units=config.vector_units or (),
        trunk_units=config.hidden_units,
        activation=config.activation,
        separate_networks=config.separate_networks,
        privileged_critic=config.privileged_critic,
        initialisation=config.initialisation,
        encoder=config.encoder,
        policy=config.policy,
        normalise=config.normalise,
        memory=config.memory,
        memory_units=config.memory_units if config.memory != "none" else 0,
    )


def architecture_from(told: Mapping[str, Any]) -> Architecture:
    """Return the row that a policy spec tells; figures it does not know are passed over.

    >>> architecture_from({"trunk_units": [8], "convolutions": [[4, 3, 1]], "distribution": "gaussian"}).convolutions
    ((4, 3, 1),)
    """
    known = {part.name for part in fields(Architecture)}
    values = {name: _tupled(value) for name, value in told.items() if name in known}
    return Architecture(**values)


def _tupled(value: Any) -> Any:
    return tuple(_tupled(part) for part in value) if isinstance(value, list | tuple) else value
