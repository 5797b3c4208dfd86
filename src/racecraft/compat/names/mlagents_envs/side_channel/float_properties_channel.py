"""Float properties: numbers that either side may set."""

from __future__ import annotations

import uuid

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage, SideChannel
from racecraft.worlds.unity.env.side_channels import FLOAT_PROPERTIES, SideChannels


class FloatPropertiesChannel(SideChannel):
    """Keeps the last value of every property."""

    def __init__(self, channel_id: uuid.UUID | None = None) -> None:
        super().__init__(channel_id or FLOAT_PROPERTIES)
        self._values: dict[str, float] = {}

    def on_message_received(self, msg: IncomingMessage) -> None:
        """Keep what the scene set."""
        key = msg.read_string()  # the name comes first; an assignment would read its right side first
        self._values[key] = msg.read_float32()

    def set_property(self, key: str, value: float) -> None:
        """Set one."""
        self._values[key] = value
        spoken = SideChannels()
        spoken.set_float_property(key, value)
        self.queue_spoken(spoken)

    def get_property(self, key: str) -> float | None:
        """Return one, or None."""
        return self._values.get(key)

    def list_properties(self) -> list[str]:
        """Return their names."""
        return list(self._values)

    def get_property_dict_copy(self) -> dict[str, float]:
        """Return all."""
        return dict(self._values)
