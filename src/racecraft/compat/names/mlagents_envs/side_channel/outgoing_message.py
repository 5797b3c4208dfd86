"""`OutgoingMessage`, where ML-Agents keeps it."""

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import OutgoingMessage

__all__ = ["OutgoingMessage"]
