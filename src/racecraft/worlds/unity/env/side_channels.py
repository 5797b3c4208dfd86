"""Side channels: bytes that ride beside the steps, for engine settings, parameters and statistics.

The bytes of one message are records, one after the other: the channel's id (16 bytes, in .NET's order), the length of
the payload (int32), the payload. Numbers are little-endian; a bool is one byte; a string is its length (int32) and
ASCII; a list of floats is its length (int32) and float32s (facts: unity-ml-agents, "Side channels").

Begin at `SideChannels`: what to send is queued by its methods and goes with the next answer; what arrives is kept in
`statistics`, `float_properties` and `raw`, and given to those who asked with `listen`.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from racecraft.worlds.unity.env.errors import WireError

ENGINE_CONFIGURATION = uuid.UUID("e951342c-4f7e-11ea-b238-784f4387d1f7")
ENVIRONMENT_PARAMETERS = uuid.UUID("534c891e-810f-11ea-a9d0-822485860400")
FLOAT_PROPERTIES = uuid.UUID("60ccf7d0-4f7e-11ea-b238-784f4387d1f7")
STATISTICS = uuid.UUID("a1d8f7b7-cec8-50f9-b78b-d3e165a78520")

AGGREGATIONS = ("average", "most_recent", "sum", "histogram")


@dataclass(frozen=True)
class Uniform:
    """A parameter drawn evenly from [low, high] at each reset."""

    low: float
    high: float


@dataclass(frozen=True)
class Gaussian:
    """A parameter drawn from a normal distribution at each reset."""

    mean: float
    deviation: float


@dataclass(frozen=True)
class MultiRange:
    """A parameter drawn from one of several ranges (low, high) at each reset."""

    ranges: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Statistic:
    """One figure that the scene recorded."""

    key: str
    value: float
    aggregation: str
    """How figures of one key belong together: average, most_recent, sum or histogram."""


@dataclass
class SideChannels:
    """Everything that rides beside the steps of one session."""

    statistics: list[Statistic] = field(default_factory=list)
    """What the scene recorded since `take_statistics` was last called."""
    float_properties: dict[str, float] = field(default_factory=dict)
    """The last value of each float property that the scene sent."""
    raw: list[tuple[uuid.UUID, bytes]] = field(default_factory=list)
    """Messages of channels that nobody listens to, the latest thousand."""
    _outgoing: bytearray = field(default_factory=bytearray)
    _listeners: dict[uuid.UUID, Callable[[bytes], None]] = field(default_factory=dict)

    def send(self, channel: uuid.UUID, payload: bytes) -> None:
        """Queue one message for a channel of the scene; it goes with the next answer."""
        self._outgoing += channel.bytes_le + struct.pack("<i", len(payload)) + payload

    def listen(self, channel: uuid.UUID, hear: Callable[[bytes], None]) -> None:
        """Have `hear` called with every message of a channel."""
        self._listeners[channel] = hear

    def set_engine(
        self,
        *,
        width: int | None = None,
        height: int | None = None,
        quality_level: int | None = None,
        time_scale: float | None = None,
        target_frame_rate: int | None = None,
        capture_frame_rate: int | None = None,
    ) -> None:
        """Set the engine: window in pixels, quality 0 to 5, simulated seconds a second, frames a second (-1: free)."""
        if (width is None) != (height is None):
            raise ValueError("width and height are set together")
        if width is not None:
            self.send(ENGINE_CONFIGURATION, struct.pack("<iii", 0, width, height))
        for kind, form, value in (
            (1, "i", quality_level),
            (2, "f", time_scale),
            (3, "i", target_frame_rate),
            (4, "i", capture_frame_rate),
        ):
            if value is not None:
                self.send(ENGINE_CONFIGURATION, struct.pack(f"<i{form}", kind, value))

    def set_parameter(self, key: str, value: float | Uniform | Gaussian | MultiRange, seed: int = 0) -> None:
        """Set an environment parameter, to a number or to a sampler that the scene draws from."""
        match value:
            case Uniform(low, high):
                payload = struct.pack("<iiiff", 1, seed, 0, low, high)
            case Gaussian(mean, deviation):
                payload = struct.pack("<iiiff", 1, seed, 1, mean, deviation)
            case MultiRange(ranges):
                payload = struct.pack("<iii", 1, seed, 2) + pack_floats([edge for pair in ranges for edge in pair])
            case _:
                payload = struct.pack("<if", 0, value)
        self.send(ENVIRONMENT_PARAMETERS, pack_string(key) + payload)

    def set_float_property(self, key: str, value: float) -> None:
        """Set a float property of the scene."""
        self.send(FLOAT_PROPERTIES, pack_string(key) + struct.pack("<f", value))

    def take_statistics(self) -> list[Statistic]:
        """Return the recorded figures and forget them."""
        taken, self.statistics = self.statistics, []
        return taken

    def take_outgoing(self) -> bytes:
        """Return what is queued, as bytes for the next answer."""
        taken, self._outgoing = bytes(self._outgoing), bytearray()
        return taken

    def receive(self, data: bytes) -> None:
        """Sort in what came with a message of the scene.

        Raises:
            WireError: The bytes are cut or lie about their length.
        """
        for channel, payload in split(data):
            reader = Reader(payload)
            if channel in self._listeners:
                self._listeners[channel](payload)
            elif channel == STATISTICS:
                key, value, kind = reader.read_string(), reader.read_float(), reader.read_int()
                if not 0 <= kind < len(AGGREGATIONS):
                    raise WireError(
                        "statistic '{key}' has aggregation {kind}; expected 0 to {count}.",
                        key=key,
                        kind=kind,
                        count=len(AGGREGATIONS) - 1,
                    )
                self.statistics.append(Statistic(key, value, AGGREGATIONS[kind]))
            elif channel == FLOAT_PROPERTIES:
                key, value = reader.read_string(), reader.read_float()
                self.float_properties[key] = value
            else:
                self.raw = [*self.raw[-999:], (channel, payload)]


@dataclass
class Reader:
    """Reads the primitives of a payload, in order."""

    data: bytes
    at: int = 0

    def read_bool(self) -> bool:
        """Read one byte."""
        return self.read(1) != b"\0"

    def read_int(self) -> int:
        """Read an int32."""
        number: int = struct.unpack("<i", self.read(4))[0]
        return number

    def read_float(self) -> float:
        """Read a float32."""
        number: float = struct.unpack("<f", self.read(4))[0]
        return number

    def read_string(self) -> str:
        """Read a length and that many ASCII characters."""
        return self.read(self.read_int()).decode("ascii", errors="replace")

    def read_floats(self) -> list[float]:
        """Read a length and that many float32s."""
        count = self.read_int()
        return list(struct.unpack(f"<{count}f", self.read(4 * count)))

    def read(self, count: int) -> bytes:
        """Read so many bytes."""
        left = len(self.data) - self.at
        if not 0 <= count <= left:
            raise WireError(
                "a side channel message claims {count} more bytes where {left} are left; it is cut or lies.",
                count=count,
                left=left,
            )
        self.at += count
        return self.data[self.at - count : self.at]


def split(data: bytes) -> list[tuple[uuid.UUID, bytes]]:
    """Cut the bytes of a message into (channel, payload) records.

    >>> channels = SideChannels()
    >>> channels.set_engine(time_scale=20.0)
    >>> [(channel == ENGINE_CONFIGURATION, payload.hex()) for channel, payload in split(channels.take_outgoing())]
    [(True, '020000000000a041')]
    """
    reader, records = Reader(data), []
    while reader.at < len(data):
        channel = uuid.UUID(bytes_le=reader.read(16))
        records.append((channel, reader.read(reader.read_int())))
    return records


def pack_string(text: str) -> bytes:
    r"""Return a string as payload bytes.

    >>> pack_string("mass")
    b'\x04\x00\x00\x00mass'
    """
    try:
        data = text.encode("ascii")
    except UnicodeEncodeError as cause:
        raise ValueError(f"{text!r}: side channels carry ASCII only") from cause
    return struct.pack("<i", len(data)) + data


def pack_floats(numbers: Sequence[float]) -> bytes:
    """Return a list of floats as payload bytes."""
    return struct.pack(f"<i{len(numbers)}f", len(numbers), *numbers)
