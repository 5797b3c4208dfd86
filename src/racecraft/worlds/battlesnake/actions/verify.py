"""Replay games by our rules and count what differs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.game_files import Report


@dataclass(frozen=True, kw_only=True)
class VerifyRequest(Request):
    """Which games are replayed."""

    record: Path = argument("Games: see below; may be gzipped.")


@dataclass(frozen=True)
class Verified:
    """What differs from our rules."""

    report: Report
    exit_code: int
    """1: something differs."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the counts by name."""
        return self.report.to_dict()


@action
def verify(request: VerifyRequest, progress: Progress = quiet) -> Verified:
    """Replay games by our rules and count what differs; exit code 1 where something does.

    It takes what `snakes play --output` and the official `battlesnake play --output` write, a snake's own log of a
    production game, the production engine's frames, and recorded games as JSON Lines.

    Example: racecraft snakes verify game.jsonl

    Example: racecraft snakes verify games.jsonl.gz --json
    """
    from racecraft.worlds.battlesnake.evaluation.game_files import verify_file

    report = verify_file(request.record)
    return Verified(report, 0 if report.agrees else 1)
