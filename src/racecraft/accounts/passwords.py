"""Hashes of passwords by Argon2id, and which passwords are accepted. Begin with `hash_password`."""

from __future__ import annotations

import functools
import threading
from typing import TYPE_CHECKING

from racecraft.accounts.people import AccountError

if TYPE_CHECKING:
    from argon2 import PasswordHasher

MIN_CHARACTERS, MAX_BYTES = 10, 512
"""NIST SP 800-63B asks for 8 or more and no rules about kinds of characters; a name or one letter again and again is
refused beyond that."""
AT_ONCE = threading.Semaphore(2)
"""One hash takes 64 MiB and 50 ms of a core."""


def hash_password(password: str, name: str = "") -> str:
    """Return a hash with its salt and parameters.

    Args:
        password: What was chosen.
        name: Whose it is; a password that is the name is refused.

    Raises:
        AccountError: It is too short, too long, or the name.
    """
    if len(password) < MIN_CHARACTERS or len(set(password)) < 4:
        raise AccountError(
            "The password has {count} characters; expected {least} or more, four of them different.",
            count=len(password), least=MIN_CHARACTERS,
        )  # fmt: skip
    if len(password.encode("utf-8", "replace")) > MAX_BYTES:
        raise AccountError("The password is too long; expected at most {most} bytes.", most=MAX_BYTES)
    if name and password.casefold() == name.casefold():
        raise AccountError("The password is the name; expected another.")
    with AT_ONCE:
        return _hasher().hash(password)


def matches(kept: str, password: str) -> bool:
    """Tell whether a password belongs to a hash; it takes as long where there is no hash ("")."""
    from argon2.exceptions import InvalidHashError, VerificationError

    if len(password.encode("utf-8", "replace")) > MAX_BYTES:
        return False
    with AT_ONCE:
        try:
            return _hasher().verify(kept or _of_nobody(), password) and bool(kept)
        except (VerificationError, InvalidHashError):
            return False


def is_outdated(kept: str) -> bool:
    """Tell whether a hash was made with weaker parameters than today's."""
    return _hasher().check_needs_rehash(kept)


@functools.cache
def _hasher() -> PasswordHasher:
    from argon2 import PasswordHasher

    return PasswordHasher()


@functools.cache
def _of_nobody() -> str:
    return _hasher().hash("nobody's password")
