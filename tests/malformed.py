"""Malformed files, made from sound ones by chance: what a disk, a download or a person makes of them.

Begin with `damaged`: a kind of damage (`KINDS`), the bytes of a sound file, a random generator → what is put in its
place. Readers answer each with an error of ours, in little time and memory.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import resource
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

DEEP, LONG_NUMBER, MANY, LONG_TEXT = 100_000, 6_000, 100_000, 100_000
SURROGATE = "\\ud83d"
"""Half of a character, as JSON may spell it."""


def _swapped(data: bytes, rng: random.Random, value: str) -> bytes:
    """Put a JSON value in the place of one that the file holds; the value alone where it holds none."""
    spots = [at for at in range(1, len(data) - 1) if data[at : at + 1] in b":[,"]
    if not spots or not data.lstrip().startswith((b"{", b"[")):
        return value.encode()
    at = rng.choice(spots) + 1
    end = at
    while end < len(data) and data[end : end + 1] not in b",]}\n":
        end += 1
    return data[:at] + value.encode() + data[end:]


def _bytes_changed(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data or b"\0")
    for _ in range(rng.randint(1, 20)):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def _other_value(data: bytes, rng: random.Random) -> bytes:
    values = ["null", "true", "[]", "{}", '""', "-1", "1e999", "0", '"x"', "[[]]", '{"a": 1}', "NaN", "-Infinity"]
    return _swapped(data, rng, rng.choice(values))


def _lines_shuffled(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    rng.shuffle(lines)
    return b"\r\n".join(lines + lines[: len(lines) // 2])


KINDS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "empty": lambda data, rng: b"",
    "cut short": lambda data, rng: data[: rng.randrange(max(1, len(data)))],
    "bytes changed": _bytes_changed,
    "other bytes": lambda data, rng: rng.randbytes(rng.randint(1, 4096)),
    "nulls": lambda data, rng: b"\0" * rng.randint(1, 4096),
    "begun late": lambda data, rng: data[rng.randrange(max(1, len(data))) :],
    "deep": lambda data, rng: rng.choice([b"[" * DEEP, b'{"a":' * DEEP, _swapped(data, rng, "[" * DEEP)]),
    "a long number": lambda data, rng: _swapped(data, rng, rng.choice("-1") + "9" * LONG_NUMBER),
    "half a character": lambda data, rng: _swapped(data, rng, f'{{"{SURROGATE}": "{SURROGATE}"}}'),
    "another value": _other_value,
    "many values": lambda data, rng: _swapped(data, rng, "[" + "0," * MANY + "0]"),
    "a long text": lambda data, rng: _swapped(data, rng, '"' + "x" * LONG_TEXT + '"'),
    "UTF-16": lambda data, rng: data.decode("utf-8", "replace").encode("utf-16"),
    "a web page": lambda data, rng: b"<!DOCTYPE html><html><body>Not Found</body></html>",
    "lines shuffled": _lines_shuffled,
    "twice": lambda data, rng: data + data,
}
"""Damage to the bytes of a file."""
PLACES = ("a pipe", "a device", "a folder", "a broken link")
"""What stands where the file should be, and is none."""


def put_place(path: Path, place: str) -> None:
    """Put what is no file at a path."""
    if path.is_dir() and not path.is_symlink():
        return
    path.unlink(missing_ok=True)
    if place == "a pipe":
        os.mkfifo(path)
    elif place == "a device":
        path.symlink_to("/dev/zero")
    elif place == "a folder":
        path.mkdir()
    else:
        path.symlink_to(path.with_name("nowhere"))


def clear(path: Path) -> None:
    """Take away whatever stands at a path."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    else:
        path.unlink(missing_ok=True)


class HangError(Exception):
    """A reader took too long."""


@contextlib.contextmanager
def within(seconds: int, memory_gib: float = 6.0) -> Iterator[None]:
    """Raise HangError in what takes longer, also while it waits for a pipe; MemoryError in what takes more memory."""

    def stop(*_: Any) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, stop)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + int(memory_gib * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, limits[1]))
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        signal.signal(signal.SIGALRM, before)


def json_bytes(value: Any) -> bytes:
    """Return a JSON file."""
    return json.dumps(value, indent=1).encode()
