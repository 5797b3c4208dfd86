"""What is said of an address that cannot be listened on."""

from __future__ import annotations

import os

from racecraft.players.battlesnake.protocol import PlayerError


def port_error(host: str, port: int, error: OSError | OverflowError) -> PlayerError:
    """Return the letter about an address that cannot be listened on.

    >>> import errno
    >>> print(port_error("127.0.0.1", 8000, OSError(errno.EADDRINUSE, "error while attempting to bind ...")))
    127.0.0.1:8000: cannot be listened on (Address already in use); choose another --port.
    """
    why = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
    return PlayerError(f"{host}:{port}: cannot be listened on ({why}); choose another --port.")
