"""The built-in players."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request


@dataclass(frozen=True, kw_only=True)
class PlayersRequest(Request):
    """Nothing is asked."""


@dataclass(frozen=True)
class BuiltInPlayers:
    """Each player and what it does, the weakest first."""

    players: Mapping[str, str]


@action
def list_players(request: PlayersRequest, progress: Progress = quiet) -> BuiltInPlayers:
    """List the built-in players, weakest first."""
    from racecraft.worlds.battlesnake.players.find import PLAYERS

    return BuiltInPlayers(PLAYERS)
