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
            return datetime.fromtimestamp(time.time() + float(text[1:-1]) * units[text[-1]]).timestamp()
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError, OSError) as error:
        raise SettingError(
            "{name} is {text!r}; expected a moment such as 2026-12-01T18:00, or +90m, +3h, +2d from now.",
            name=name,
            text=text,
        ) from error


def title_of(text: str, what: str) -> str:
    """Return the title that a user typed.

    Args:
        text: As it was typed.
        what: Whose, for the message: "race".

    Raises:
        SettingError: It is empty.
    """
    if not text.strip():
        raise SettingError("the title is empty; expected a name for the {what}.", what=what)
    return text.strip()


def require_dates(is_practice: bool, opens: float | None, closes: float | None, season: str) -> None:
    """Refuse a deadline that does not come after the opening, and all dates of a practice race.

    Raises:
        SettingError: One of both.
    """
    if is_practice and (opens is not None or closes is not None or season):
        raise SettingError(
            "a practice race is always open and in no season; expected none of --opens, --closes, --season."
        )
    if opens is not None and closes is not None and closes <= opens:
        raise SettingError("--closes is not after --opens; expected a later moment.")


def user_name() -> str:
    """Return what a board calls the user of this account where no other name is given."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "racer"
