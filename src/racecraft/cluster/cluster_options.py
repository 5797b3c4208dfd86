"""What `--cluster` was given. Begin with `read_cluster`."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import SettingError

AUTO = "auto"
EXPECTED = (
    "expected N (so many workers on this machine), auto (the Ray cluster that this machine belongs to), HOST:PORT (the "
    "cluster of that address), or N@auto and N@HOST:PORT (so many workers of it)"
)


@dataclass(frozen=True)
class ClusterOptions:
    """Where workers are to be found."""

    workers: int | None
    """How many; None: as many as the cluster has cores, one left for the learner."""
    address: str | None
    """`AUTO` or HOST:PORT of a cluster that stands; None: one is made here, for this training only."""

    def __str__(self) -> str:
        """Return it as it is typed."""
        return "@".join(str(part) for part in (self.workers, self.address) if part is not None)


def read_cluster(text: str) -> ClusterOptions:
    """Read what `--cluster` was given.

    Raises:
        SettingError: It is none of what may be given.

    >>> read_cluster("8@10.0.0.5:6379")
    ClusterOptions(workers=8, address='10.0.0.5:6379')
    """
    count, at, address = text.rpartition("@")
    if not at and text.lstrip("-").isdigit():
        count, address = text, ""
    if at and not (count and address) or not (count or address):
        raise SettingError("--cluster is '{text}'; {expected}.", text=text, expected=EXPECTED)
    return ClusterOptions(_workers(count, text) if count else None, _address(address, text) if address else None)


def _workers(count: str, text: str) -> int:
    if not count.isdigit() or int(count) < 1:
        raise SettingError("--cluster is '{text}'; {expected}, N at least 1.", text=text, expected=EXPECTED)
    return int(count)


def _address(address: str, text: str) -> str:
    host, _, port = address.rpartition(":")
    if address == AUTO or (host and port.isdigit() and 0 < int(port) < 65536):
        return address
    raise SettingError("--cluster is '{text}'; {expected}.", text=text, expected=EXPECTED)
