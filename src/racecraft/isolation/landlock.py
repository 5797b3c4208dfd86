"""Landlock: a process gives up every file but those that are named. Begin with `restrict_files`.

Linux 5.13 and newer; no privilege is needed. Numbers are those of `linux/landlock.h`; a right that the running kernel
does not know must not be asked for, so every mask goes by the version (ABI) that the kernel reports.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import stat
import struct
from collections.abc import Iterable

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
"""System calls, the same on every architecture."""
ASK_VERSION, PATH_BENEATH = 1, 1
READ_FILE, READ_DIR = 1 << 2, 1 << 3
WRITE_FILE, REMOVE_DIR, REMOVE_FILE, MAKE_DIR, MAKE_FILE, MOVE, TRUNCATE = (1 << bit for bit in (1, 4, 5, 7, 8, 13, 14))
READ = READ_FILE | READ_DIR
WRITE = WRITE_FILE | REMOVE_DIR | REMOVE_FILE | MAKE_DIR | MAKE_FILE | MOVE | TRUNCATE
"""Files and folders; no programs, devices, pipes, sockets and links."""
FILE_RIGHTS = ((1, 13), (2, 14), (3, 15), (5, 16))
"""How many bits of rights on files there are from which ABI on: execute, read, write, make, remove, move …"""
NETWORK_ABI, NETWORK_RIGHTS = 4, 0b11
"""Bind and connect of TCP."""
SCOPE_ABI, SCOPES = 6, 0b11
"""Abstract Unix sockets and signals: only within the restricted process."""


def abi() -> int:
    """Return the version of Landlock that the kernel has; 0: none."""
    return max(0, int(_libc().syscall(CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(ASK_VERSION))))


def restrict_files(readable: Iterable[str], scratch: str | None = None) -> int:
    """Let this process open nothing from now on but files and folders (with all below them) for reading.

    The process must have given up new privileges before (`layers.py`). What is open already stays open.

    Args:
        readable: Paths; one that does not exist is left out.
        scratch: A folder in which it may write, too; None: nowhere.

    Returns:
        The ABI in force; 0: the kernel has no Landlock, and nothing was restricted.
    """
    version = abi()
    if not version:
        return 0
    files = (1 << max(bits for since, bits in FILE_RIGHTS if version >= since)) - 1
    network = NETWORK_RIGHTS if version >= NETWORK_ABI else 0
    scopes = SCOPES if version >= SCOPE_ABI else 0
    attributes = struct.pack("=QQQ", files, network, scopes)
    size = 24 if version >= SCOPE_ABI else 16 if version >= NETWORK_ABI else 8
    rules = _call(CREATE_RULESET, attributes, ctypes.c_size_t(size), ctypes.c_uint32(0))
    try:
        for path in readable:
            with contextlib.suppress(FileNotFoundError, NotADirectoryError, PermissionError):
                _allow(rules, path, READ)
        if scratch is not None:
            _allow(rules, scratch, (READ | WRITE) & files)
        _call(RESTRICT_SELF, ctypes.c_int(rules), ctypes.c_uint32(0))
    finally:
        os.close(rules)
    return version


def _allow(rules: int, path: str, rights: int) -> None:
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rights &= rights if stat.S_ISDIR(os.fstat(place).st_mode) else READ_FILE
        rule = struct.pack("=Qi", rights, place)
        _call(ADD_RULE, ctypes.c_int(rules), ctypes.c_int(PATH_BENEATH), rule, ctypes.c_uint32(0))
    finally:
        os.close(place)


def _call(*arguments: object) -> int:
    got = int(_libc().syscall(*arguments))
    if got < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return got


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
