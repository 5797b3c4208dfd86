"""`IncomingMessage`, where ML-Agents keeps it."""

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage

__all__ = ["IncomingMessage"]
