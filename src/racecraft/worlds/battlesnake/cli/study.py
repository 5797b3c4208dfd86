"""`racecraft snakes study`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.study import Study
from racecraft.worlds.battlesnake.actions.study import study as action

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.game_analysis import Loss


def _show(found: Study) -> None:
    for loss in found.losses:
        _print(loss, found.names)
    if not found.losses:
        print("Nobody lost in what was recorded.")


def _print(loss: Loss, names: dict[str, str]) -> None:
    """Print one loss: who, when, why; the board; the move that was made and the one that search prefers."""
    from racecraft.worlds.battlesnake.env.board import draw
    from racecraft.worlds.battlesnake.evaluation.game_analysis import finding_text

    letter = chr(ord("A") + [snake.id for snake in loss.board.snakes].index(loss.snake_id) % 26)
    by = f" by {names.get(loss.by, loss.by)}" if loss.by not in ("", loss.snake_id) else ""
    print(f"\n{names.get(loss.snake_id, loss.snake_id)} ({letter}): {loss.cause}{by} on turn {loss.died_on}")
    if loss.further_back:
        print(f"lost already at turn {loss.turn}, as far back as was looked (--back, --effort)")
    print("\n".join(f"    {row}" for row in draw(loss.board).splitlines()))
    print(f"turn {loss.turn}: played {loss.played}, {finding_text(loss.played_finding, loss.turn)}")
    if loss.better == loss.played:
        print("         search would have played the same: what lost it lies beyond what it saw (--effort)")
    else:
        print(f"         search would have played {loss.better}, {finding_text(loss.better_finding, loss.turn)}")


study = command(action, _show)
