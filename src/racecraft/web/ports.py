"""Addresses to listen on: what is said of one that cannot be, and how the next free one is found."""

from __future__ import annotations

import ipaddress
import os
import socket

from racecraft.contract.errors import UserInputError

LOOPBACK = "127.0.0.1"
FURTHER = 20
"""So many ports behind a taken one are tried."""


class PortError(UserInputError):
    """An address cannot be listened on."""


def port_error(host: str, port: int, error: OSError | OverflowError) -> PortError:
    """Return the error about an address that cannot be listened on.

    >>> import errno
    >>> print(port_error("127.0.0.1", 8000, OSError(errno.EADDRINUSE, "error while attempting to bind ...")))
    127.0.0.1:8000: cannot be listened on (Address already in use); choose another --port.
    """
    why = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
    return PortError(
        "{host}:{port}: cannot be listened on ({why}); choose another --port.", host=host, port=port, why=why
    )


def is_free(port: int, host: str = LOOPBACK) -> bool:
    """Tell whether a port can be listened on just now."""
    with socket.socket() as probe:
        if os.name != "nt":
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError):
            return False
    return True


def next_free(port: int, host: str = LOOPBACK) -> int | None:
    """Return the next free port behind one that is taken; None where none of the next FURTHER is."""
    return next((one for one in range(port + 1, min(port + FURTHER, 65535) + 1) if is_free(one, host)), None)


def choose_port(requested: int | None, usual: int) -> tuple[int, str]:
    """Return the port to listen on, and what is worth saying about it.

    Args:
        requested: What somebody insists on; None: the usual one, or where it is taken the next free.
        usual: The port where nobody says.

    Raises:
        PortError: The one insisted on is taken, or none is free; the message names the next free one.
    """
    port = usual if requested is None else requested
    if port == 0 or is_free(port):
        return port, ""
    free = next_free(port) if 0 < port < 65536 else None
    if requested is not None or free is None:
        offer = f"--port {free} is free" if free else "choose another --port, such as 0 for any free one"
        raise PortError(
            "{loopback}:{port}: is taken or not allowed; {offer}.", loopback=LOOPBACK, port=port, offer=offer
        )
    return free, f"port {usual} is taken; the page stands on {free}"


def is_loopback(host: str) -> bool:
    """Tell whether an address is this machine's alone.

    >>> is_loopback("127.0.0.1"), is_loopback("localhost"), is_loopback("0.0.0.0")
    (True, True, False)
    """
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def listen_on(host: str, port: int) -> socket.socket:
    """Return a socket that listens; its own port stands in `getsockname()` where 0 was asked for.

    Raises:
        PortError: The address cannot be listened on.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family)
    try:
        if os.name != "nt":
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen(1024)
        listening.setblocking(False)
    except (OSError, OverflowError) as error:
        listening.close()
        raise port_error(host, port, error) from error
    return listening
