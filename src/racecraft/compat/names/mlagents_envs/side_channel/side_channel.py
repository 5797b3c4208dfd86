"""A side channel of your own: derive from `SideChannel`, or use one of the known ones beside this page."""

from __future__ import annotations

import struct
import uuid
from abc import ABC, abstractmethod
from collections.abc import Sequence

from racecraft.worlds.unity.env.side_channels import Reader, SideChannels, pack_floats, pack_string, split


class IncomingMessage:
    """What a scene said; read in the order in which it was written. A value past the end is the default."""

    def __init__(self, buffer: bytes, offset: int = 0) -> None:
        self._reader = Reader(buffer, offset)

    def read_bool(self, default_value: bool = False) -> bool:
        """Read one byte."""
        return default_value if self._at_end else self._reader.read_bool()

    def read_int32(self, default_value: int = 0) -> int:
        """Read an int32."""
        return default_value if self._at_end else self._reader.read_int()

    def read_float32(self, default_value: float = 0.0) -> float:
        """Read a float32."""
        return default_value if self._at_end else self._reader.read_float()

    def read_float32_list(self, default_value: list[float] | None = None) -> list[float]:
        """Read a list of float32."""
        return (default_value or []) if self._at_end else self._reader.read_floats()

    def read_string(self, default_value: str = "") -> str:
        """Read a string."""
        return default_value if self._at_end else self._reader.read_string()

    def get_raw_bytes(self) -> bytes:
        """Return the whole message."""
        return self._reader.data

    @property
    def _at_end(self) -> bool:
        return self._reader.at >= len(self._reader.data)


class OutgoingMessage:
    """What is said to a scene."""

    def __init__(self) -> None:
        self.buffer = bytearray()

    def write_bool(self, b: bool) -> None:
        """Write one byte."""
        self.buffer += struct.pack("<?", b)

    def write_int32(self, i: int) -> None:
        """Write an int32."""
        self.buffer += struct.pack("<i", i)

    def write_float32(self, f: float) -> None:
        """Write a float32."""
        self.buffer += struct.pack("<f", f)

    def write_float32_list(self, float_list: Sequence[float]) -> None:
        """Write a list of float32."""
        self.buffer += pack_floats(float_list)

    def write_string(self, s: str) -> None:
        """Write a string of ASCII."""
        self.buffer += pack_string(s)

    def set_raw_bytes(self, buffer: bytes) -> None:
        """Set the whole message."""
        self.buffer = bytearray(buffer)


class SideChannel(ABC):
    """A channel: override `on_message_received`."""

    def __init__(self, channel_id: uuid.UUID) -> None:
        self.channel_id = channel_id
        self._queued: list[bytes] = []

    def queue_message_to_send(self, msg: OutgoingMessage) -> None:
        """Have a message go with the next step or reset."""
        self._queued.append(bytes(msg.buffer))

    def queue_spoken(self, spoken: SideChannels) -> None:
        """Have what our own side channels would say go with the next step or reset."""
        self._queued += [payload for _, payload in split(spoken.take_outgoing())]

    @abstractmethod
    def on_message_received(self, msg: IncomingMessage) -> None:
        """Hear a message of the scene."""

    def deliver(self, payload: bytes) -> None:
        """Have a payload of the scene read by `on_message_received`."""
        self.on_message_received(IncomingMessage(payload))

    def take_queued(self) -> list[bytes]:
        """Return what is to go, and forget it."""
        taken, self._queued = self._queued, []
        return taken
