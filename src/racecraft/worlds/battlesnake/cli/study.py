"""`racecraft snakes study`: the move that lost a game, and what search would have played."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import JSON

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.game_analysis import Loss


def study(
    game: Annotated[Path, typer.Argument(help="A game as `snakes verify` takes it; may be gzipped.")],
    snake: Annotated[
        list[str] | None, typer.Option("--snake", help="Id or name of a snake that lost; without it, all that did.")
    ] = None,
    effort: Annotated[
        int, typer.Option(min=100, max=10_000_000, help="Turns played forward to judge one position.")
    ] = 20_000,
    back: Annotated[int, typer.Option(min=1, max=10_000, help="Turns to go back from a snake's end.")] = 60,
    json: JSON = False,
) -> None:
    """Show the move that lost a game, and what search would have played.

    From a snake's end it goes back while the position is lost whatever the snake does, to the last one that was not.
    It takes what `snakes play --output` and the official `battlesnake play --output` write, a snake's own log of a
    production game, the production engine's frames, and recorded games as JSON Lines.

    Example: racecraft snakes study game.jsonl

    Example: racecraft snakes study game.jsonl --snake my_snake --effort 200000
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.battlesnake.evaluation.game_analysis import study_games
    from racecraft.worlds.battlesnake.evaluation.game_files import games_of, snake_names

    games, names = list(games_of(game)), snake_names(game)
    ids = [next((one for one, name in names.items() if name == asked), asked) for asked in snake or []]
    say("Studying …", quiet_stdout=json)
    losses = study_games(games, ids, effort, back)
    if json:
        print_json({"losses": [loss.to_dict() | {"name": names.get(loss.snake_id, "")} for loss in losses]})
        return
    for loss in losses:
        _print(loss, names)
    if not losses:
        print("Nobody lost in what was recorded.")


def _print(loss: Loss, names: dict[str, str]) -> None:
    """Print one loss: who, when, why; the board; the move that was made and the one that search prefers."""
    from racecraft.worlds.battlesnake.env.board import draw
    from racecraft.worlds.battlesnake.evaluation.game_analysis import words

    letter = chr(ord("A") + [snake.id for snake in loss.board.snakes].index(loss.snake_id) % 26)
    by = f" by {names.get(loss.by, loss.by)}" if loss.by not in ("", loss.snake_id) else ""
    print(f"\n{names.get(loss.snake_id, loss.snake_id)} ({letter}): {loss.cause}{by} on turn {loss.died_on}")
    if loss.further_back:
        print(f"lost already at turn {loss.turn}, as far back as was looked (--back, --effort)")
    print("\n".join(f"    {row}" for row in draw(loss.board).splitlines()))
    print(f"turn {loss.turn}: played {loss.played}, {words(loss.played_finding, loss.turn)}")
    if loss.better == loss.played:
        print("         search would have played the same: what lost it lies beyond what it saw (--effort)")
    else:
        print(f"         search would have played {loss.better}, {words(loss.better_finding, loss.turn)}")
