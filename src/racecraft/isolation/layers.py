"""What a process gives up before it runs a stranger's code. Begin with `restrict`.

Each step is independent of the others: where a kernel or a container lacks one, the rest holds.

    no new privileges   no program that it could start has more rights (and it starts none)
    namespaces          a network of its own, without any interface
    capabilities        none; root keeps those by which it reads files that Landlock allows
    limits              no new files, or files of so many bytes; no new processes; so many bytes of memory
    Landlock            no files but those that are named; no TCP, no signals to others where the kernel is new enough
    seccomp             no sockets, processes, programs, signals to others, changes of modes and owners
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Sequence

from racecraft.isolation import landlock, seccomp

NO_NEW_PRIVILEGES, NO_NEW_USER, NO_NEW_NETWORK = 38, 0x10000000, 0x40000000
CAPABILITY_VERSION = 0x20080522
READ_ANY_FILE = 1 << 1 | 1 << 2
"""CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH: without them root cannot enter the folders of others."""


def can_isolate() -> bool:
    """Tell whether this system holds strangers' code to `restrict`'s promise: files, network and processes.

    Where it does not, code may run only if its owner asked for that very file.
    """
    return sys.platform == "linux" and landlock.abi() > 0 and seccomp.is_available()


def restrict(
    readable: Sequence[str], memory_bytes: int, scratch: str | None = None, file_bytes: int = 0, threads: bool = False
) -> tuple[str, ...]:
    """Give up everything but computing and reading what is named; there is no way back.

    Call it in a process with one thread, before it imports anything that starts others.

    Args:
        readable: Files and folders (with all below them) that may be opened for reading.
        memory_bytes: How much memory the process may have for its data.
        scratch: A folder of its own in which it may write, too; None: nowhere.
        file_bytes: How long a file there may be.
        threads: Whether it may start threads, which are held to the same; processes it may not.

    Returns:
        The layers that hold, by name, such as "Landlock 7".
    """
    if sys.platform != "linux":
        return ()
    libc = ctypes.CDLL(None, use_errno=True)
    # PyTorch for CUDA has ctypes look for a library, which wants a folder to write in where PATH leads to a compiler.
    os.environ["PATH"] = ""
    held = []
    if libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0) == 0:
        held.append("no new privileges")
    is_root = os.geteuid() == 0
    if libc.unshare(NO_NEW_NETWORK if is_root else NO_NEW_NETWORK | NO_NEW_USER) == 0:
        held.append("network namespace")
    if _give_up_capabilities(libc, READ_ANY_FILE if is_root else 0):
        held.append("no capabilities")
    _limit(memory_bytes, file_bytes, threads)
    held.append("limits")
    if version := landlock.restrict_files(readable, scratch):
        held.append(f"Landlock {version}")
    if seccomp.deny_calls(threads):
        held.append("seccomp")
    return tuple(held)


def _give_up_capabilities(libc: ctypes.CDLL, kept: int) -> bool:
    header = struct.pack("=Ii", CAPABILITY_VERSION, 0)
    data = struct.pack("=6I", *(kept, kept, 0, 0, 0, 0))  # effective, permitted, inheritable; the upper 32 bits
    return int(libc.capset(header, data)) == 0


def _limit(memory_bytes: int, file_bytes: int, threads: bool) -> None:
    import resource

    limits = (
        *([] if threads else [(resource.RLIMIT_NPROC, 0)]),  # which counts threads, too
        (resource.RLIMIT_FSIZE, file_bytes),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_DATA, memory_bytes),
    )
    for kind, value in limits:
        _, most = resource.getrlimit(kind)
        value = value if most == resource.RLIM_INFINITY else min(value, most)
        resource.setrlimit(kind, (value, value))
