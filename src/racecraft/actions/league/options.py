"""Which league a command is about, and which of its races."""

from __future__ import annotations

import getpass
import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from racecraft.contract.errors import SettingError
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.league.store import League

LEAGUE, VARIABLE = "league", "RACECRAFT_LEAGUE"


@dataclass(frozen=True, kw_only=True)
class LeagueOptions(Request):
    """The league's folder."""

    PANEL: ClassVar[str] = "The league"
    league: Path = option(Path(LEAGUE), "The league's folder.", variable=VARIABLE)

    def open(self) -> League:
        """Return the league.

        Raises:
            LeagueError: There is none.
        """
        from racecraft.league.store import League

        return League(self.league)


@dataclass(frozen=True, kw_only=True)
class RaceNamed(LeagueOptions):
    """One race of a league."""

    race: str = argument("A race's id or title; `racecraft league list` shows them.")


def moment(text: str | None, name: str) -> float | None:
    """Return a moment that a user typed, s since 1970; without a zone in the local one; None: none was typed.

    Args:
        text: ISO 8601, such as "2026-12-01 18:00", or "+90m", "+3h", "+2d" from now.
        name: Of the option, for the message.

    Raises:
        SettingError: It is neither.
    """
    if text is None or text == "":
        return None
    units = {"m": 60.0, "h": 3600.0, "d": 86400.0}
    try:
        if text.startswith("+") and text[-1] in units:
            return time.time() + float(text[1:-1]) * units[text[-1]]
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError) as error:
        raise SettingError(
            "{name} is {text!r}; expected a moment such as 2026-12-01T18:00, or +90m, +3h, +2d from now.",
            name=name,
            text=text,
        ) from error


def user_name() -> str:
    """Return what a board calls the user of this account where no other name is given."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "racer"
