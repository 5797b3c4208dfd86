"""Bytes as they are."""

from __future__ import annotations

import uuid

from racecraft.compat.names.mlagents_envs.side_channel.side_channel import IncomingMessage, OutgoingMessage, SideChannel


class RawBytesChannel(SideChannel):
    """Keeps what came until it is taken."""

    def __init__(self, channel_id: uuid.UUID) -> None:
        super().__init__(channel_id)
        self._received: list[bytes] = []

    def on_message_received(self, msg: IncomingMessage) -> None:
        """Keep a message."""
        self._received.append(msg.get_raw_bytes())

    def get_and_clear_received_messages(self) -> list[bytes]:
        """Return what came, and forget it."""
        taken, self._received = self._received, []
        return taken

    def send_raw_data(self, data: bytes) -> None:
        """Have bytes go with the next step or reset."""
        message = OutgoingMessage()
        message.set_raw_bytes(data)
        self.queue_message_to_send(message)
