"""Environment parameters: numbers of a scene, or how they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from racecraft.compat.names.mlagents_envs.exception import UnityCommunicationException
from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage, SideChannel
from racecraft.worlds.unity.env.side_channels import (
    ENVIRONMENT_PARAMETERS,
    Gaussian,
    MultiRange,
    SideChannels,
    Uniform,
)


class EnvironmentParametersChannel(SideChannel):
    """Sets parameters of the scene."""

    class EnvironmentDataTypes(IntEnum):
        """How a parameter is given."""

        FLOAT = 0
        SAMPLER = 1

    class SamplerTypes(IntEnum):
        """How a parameter is drawn."""

        UNIFORM = 0
        GAUSSIAN = 1
        MULTIRANGEUNIFORM = 2

    def __init__(self) -> None:
        super().__init__(ENVIRONMENT_PARAMETERS)

    def on_message_received(self, msg: IncomingMessage) -> None:
        """Refuse: scenes do not speak here."""
        raise UnityCommunicationException("the environment parameters channel only speaks to the player")

    def set_float_parameter(self, key: str, value: float) -> None:
        """Set a number."""
        self._set(key, value)

    def set_uniform_sampler_parameters(self, key: str, min_value: float, max_value: float, seed: int) -> None:
        """Have it drawn evenly."""
        self._set(key, Uniform(min_value, max_value), seed)

    def set_gaussian_sampler_parameters(self, key: str, mean: float, st_dev: float, seed: int) -> None:
        """Have it drawn from a normal distribution."""
        self._set(key, Gaussian(mean, st_dev), seed)

    def set_multirangeuniform_sampler_parameters(
        self, key: str, intervals: Sequence[tuple[float, float]], seed: int
    ) -> None:
        """Have it drawn from several ranges."""
        self._set(key, MultiRange(tuple((low, high) for low, high in intervals)), seed)

    def _set(self, key: str, value: float | Uniform | Gaussian | MultiRange, seed: int = 0) -> None:
        spoken = SideChannels()
        spoken.set_parameter(key, value, seed)
        self.queue_spoken(spoken)
