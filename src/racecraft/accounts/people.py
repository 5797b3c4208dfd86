"""A person who uses a console, and the four roles. Begin with `Role`."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from enum import StrEnum

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.message import shortened

LEGAL_NAME = re.compile(r"\w(?:[\w .+-]{0,30}\w)?")


class AccountError(UserInputError):
    """A person, password, invitation or session cannot be used."""


class Role(StrEnum):
    """What a person is here; each role may do what the ones behind it may."""

    OWNER = "owner"
    ORGANISER = "organiser"
    RACER = "racer"
    SPECTATOR = "spectator"

    @property
    def rank(self) -> int:
        """How much it may do: 0 for a spectator, 3 for the owner."""
        return list(reversed(Role)).index(self)


@dataclass(frozen=True, kw_only=True)
class Person:
    """Somebody who uses a console."""

    id: str
    """16 hexadecimal digits; "": the owner of the machine. It is never given again."""
    name: str
    role: Role
    created: float = 0.0
    """Seconds since 1970 (UTC), as all moments of this package."""
    has_password: bool = True
    """False: invited, and not yet accepted."""

    @property
    def owned(self) -> str:
        """What stands in the owner columns of this person's jobs, races and entries; "" for every owner."""
        return "" if self.role is Role.OWNER else self.id


LOCAL_OWNER = Person(id="", name="owner", role=Role.OWNER)
"""Whoever uses the machine itself: no password, every right."""


def role_named(name: str) -> Role:
    """Return a role by its name.

    Raises:
        SettingError: There is none.
    """
    try:
        return Role(name.strip().casefold())
    except ValueError:
        raise SettingError(
            "role is {found!r}; expected one of {known}.",
            found=shortened(name, 40), known=", ".join(role.value for role in Role),
        ) from None  # fmt: skip


def legal_name(name: str) -> str:
    """Return a name as it is kept: normalised, without spaces at its ends.

    Raises:
        SettingError: It is empty, too long, or holds other characters than letters, digits, spaces and . _ + -.
    """
    made = unicodedata.normalize("NFKC", name).strip()
    if not LEGAL_NAME.fullmatch(made):
        raise SettingError(
            "{found!r} is not a person's name; expected 1 to 32 letters, digits, spaces or . _ + -, "
            "with a letter or digit at both ends.",
            found=shortened(name, 60),
        )
    return made


def name_key(name: str) -> str:
    """Return what two spellings of one name share.

    >>> name_key("Ada L") == name_key("ada l")
    True
    """
    return unicodedata.normalize("NFKC", name).strip().casefold()
