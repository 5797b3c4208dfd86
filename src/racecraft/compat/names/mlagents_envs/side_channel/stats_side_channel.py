"""Statistics that a scene records."""

from __future__ import annotations

from enum import Enum

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage, SideChannel
from racecraft.worlds.unity.env.side_channels import STATISTICS


class StatsAggregationMethod(Enum):
    """How figures of one name belong together."""

    AVERAGE = 0
    MOST_RECENT = 1
    SUM = 2
    HISTOGRAM = 3


class StatsSideChannel(SideChannel):
    """Keeps figures until they are taken."""

    def __init__(self) -> None:
        super().__init__(STATISTICS)
        self._figures: dict[str, list[tuple[float, StatsAggregationMethod]]] = {}

    def on_message_received(self, msg: IncomingMessage) -> None:
        """Keep a figure."""
        key, value = msg.read_string(), msg.read_float32()
        self._figures.setdefault(key, []).append((value, StatsAggregationMethod(msg.read_int32())))

    def get_and_reset_stats(self) -> dict[str, list[tuple[float, StatsAggregationMethod]]]:
        """Return them by name, and forget them."""
        taken, self._figures = self._figures, {}
        return taken
