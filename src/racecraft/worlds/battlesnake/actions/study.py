"""Find the move that lost a game, and what search would have played."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.game_analysis import Loss


@dataclass(frozen=True, kw_only=True)
class StudyRequest(Request):
    """Which game is studied, how hard."""

    game: Path = argument("A game as `snakes verify` takes it; may be gzipped.")
    snake: tuple[str, ...] = option((), "Id or name of a snake that lost; without it, all that did.")
    effort: int = option(20_000, "Turns played forward to judge one position.", low=100, high=10_000_000)
    back: int = option(60, "Turns to go back from a snake's end.", low=1, high=10_000)


@dataclass(frozen=True)
class Study:
    """Why each snake lost."""

    losses: list[Loss]
    names: dict[str, str]
    """Of the snakes, by their id."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the losses as plain values."""
        return {"losses": [loss.to_dict() | {"name": self.names.get(loss.snake_id, "")} for loss in self.losses]}


@action
def study(request: StudyRequest, progress: Progress = quiet) -> Study:
    """Show the move that lost a game, and what search would have played.

    From a snake's end it goes back while the position is lost whatever the snake does, to the last one that was not.
    It takes what `snakes play --output` and the official `battlesnake play --output` write, a snake's own log of a
    production game, the production engine's frames, and recorded games as JSON Lines.

    Example: racecraft snakes study game.jsonl

    Example: racecraft snakes study game.jsonl --snake my_snake --effort 200000
    """
    from racecraft.worlds.battlesnake.evaluation.game_analysis import study_games
    from racecraft.worlds.battlesnake.evaluation.game_files import games_of, snake_names

    games, names = list(games_of(request.game)), snake_names(request.game)
    ids = [next((one for one, name in names.items() if name == asked), asked) for asked in request.snake]
    progress("Studying …")
    losses = study_games(games, ids, request.effort, request.back)
    return Study(list(losses), names)
