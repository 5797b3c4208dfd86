"""Several side channels as the bytes that ride beside the steps."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Sequence

from racecraft.compat.names.mlagents_envs.exception import UnityEnvironmentException
from racecraft.compat.names.mlagents_envs.side_channel.side_channel import SideChannel
from racecraft.worlds.unity.env.errors import WireError
from racecraft.worlds.unity.env.side_channels import SideChannels, split

_log = logging.getLogger("racecraft.unity")


class SideChannelManager:
    """Writes what channels have queued, and gives them what came.

    Args:
        side_channels: Each with an id of its own.

    Raises:
        UnityEnvironmentException: Two channels share an id.
    """

    def __init__(self, side_channels: Sequence[SideChannel] | None = None) -> None:
        self._side_channels_dict: dict[uuid.UUID, SideChannel] = {}
        for channel in side_channels or ():
            if channel.channel_id in self._side_channels_dict:
                raise UnityEnvironmentException(
                    f"two side channels have the id {channel.channel_id}; expected one each"
                )
            self._side_channels_dict[channel.channel_id] = channel

    @property
    def channels(self) -> list[SideChannel]:
        """All of them."""
        return list(self._side_channels_dict.values())

    def generate_side_channel_messages(self) -> bytearray:
        """Return the bytes of everything queued, and forget it."""
        spoken = SideChannels()
        for channel in self.channels:
            for payload in channel.take_queued():
                spoken.send(channel.channel_id, payload)
        return bytearray(spoken.take_outgoing())

    def process_side_channel_message(self, data: bytes) -> None:
        """Give each message to its channel; a message for nobody is passed over, and said.

        Raises:
            UnityEnvironmentException: The bytes are cut or lie about their length.
        """
        try:
            records = split(bytes(data))
        except WireError as cause:
            raise UnityEnvironmentException(str(cause)) from cause
        for channel, payload in records:
            if channel in self._side_channels_dict:
                self._side_channels_dict[channel].deliver(payload)
            else:
                _log.warning("A message for side channel %s came, and nobody listens to it.", channel)


__all__ = ["SideChannelManager"]
