"""Side channels in ML-Agents' words."""

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import (
    IncomingMessage,
    OutgoingMessage,
    SideChannel,
)

__all__ = ["IncomingMessage", "OutgoingMessage", "SideChannel"]
