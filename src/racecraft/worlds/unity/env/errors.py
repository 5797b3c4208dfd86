"""What can go wrong with a player, each a short message.

::

    RacecraftError
    └── UnityError                 anything between us and a Unity player
        ├── PlayerDiedError        the player's process ended, or its connection broke
        ├── PlayerTimeoutError     the player is silent
        ├── PlayerLeftError        the player said goodbye by itself
        ├── WireError              bytes or messages that the protocol does not allow
        │   └── WireVersionError   the player speaks another protocol version
        ├── PortTakenError         the wished port belongs to somebody else
        └── SessionClosedError     a call after close()
    UserInputError
    └── BuildError                 a build cannot be found or started
"""

from __future__ import annotations

from racecraft.contract.errors import MissingExtraError, RacecraftError, UserInputError

INSTALL = "pip install 'racecraft[unity]'"


class UnityError(RacecraftError):
    """Something between us and a Unity player."""


class PlayerDiedError(UnityError):
    """The player's process ended or its connection broke; the message holds the tail of its log."""


class PlayerTimeoutError(UnityError):
    """The player has not spoken for too long."""


class PlayerLeftError(UnityError):
    """The player ended the conversation by itself (its window was closed, or the Editor's Play button pressed)."""


class WireError(UnityError):
    """The player sent what the protocol does not allow: cut, lying or impossible messages."""


class WireVersionError(WireError):
    """The player speaks a version of the protocol that is not ours."""


class PortTakenError(UnityError):
    """The wished port is in use."""


class SessionClosedError(UnityError):
    """A session was used after it was closed."""


class BuildError(UserInputError):
    """A Unity build cannot be found, opened or started."""


def missing_extra(package: str) -> MissingExtraError:
    """Return the error about an absent package of the `unity` extra."""
    return MissingExtraError(
        "Unity worlds need the package '{package}', which is not installed. {install}", package=package, install=INSTALL
    )
