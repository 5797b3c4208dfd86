"""How fast and how fine a player runs."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from racecraft.compat.names.mlagents_envs.exception import UnityCommunicationException, UnitySideChannelException
from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage, SideChannel
from racecraft.worlds.unity.env.side_channels import ENGINE_CONFIGURATION, SideChannels


class EngineConfig(NamedTuple):
    """All settings at once."""

    width: int | None
    height: int | None
    quality_level: int | None
    time_scale: float | None
    target_frame_rate: int | None
    capture_frame_rate: int | None

    @staticmethod
    def default_config() -> EngineConfig:
        """Return what ML-Agents takes where nothing is said."""
        return EngineConfig(80, 80, 1, 20.0, -1, 60)


class EngineConfigurationChannel(SideChannel):
    """Sets the engine; what is left out stays as it is."""

    class ConfigurationType(IntEnum):
        """What a message sets."""

        SCREEN_RESOLUTION = 0
        QUALITY_LEVEL = 1
        TIME_SCALE = 2
        TARGET_FRAME_RATE = 3
        CAPTURE_FRAME_RATE = 4

    def __init__(self) -> None:
        super().__init__(ENGINE_CONFIGURATION)

    def on_message_received(self, msg: IncomingMessage) -> None:
        """Refuse: engines do not speak here."""
        raise UnityCommunicationException("the engine configuration channel only speaks to the player")

    def set_configuration_parameters(
        self,
        width: int | None = None,
        height: int | None = None,
        quality_level: int | None = None,
        time_scale: float | None = None,
        target_frame_rate: int | None = None,
        capture_frame_rate: int | None = None,
    ) -> None:
        """Set window in pixels, quality, simulated seconds a second, frames a second (-1: free)."""
        if (width is None) != (height is None):
            raise UnitySideChannelException("width and height are set together")
        self.set_configuration(
            EngineConfig(width, height, quality_level, time_scale, target_frame_rate, capture_frame_rate)
        )

    def set_configuration(self, config: EngineConfig) -> None:
        """Set all that is given."""
        spoken = SideChannels()
        spoken.set_engine(**config._asdict())
        self.queue_spoken(spoken)
