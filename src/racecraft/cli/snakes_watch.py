"""`racecraft snakes gif`: games to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def gif(
    game: Annotated[Path, typer.Argument(help="A game from `snakes play --output`.")],
    picture: Annotated[Path, typer.Argument(help="The GIF to write.")],
    fps: Annotated[float, typer.Option(min=0.1, max=50, help="Turns a second.")] = 8,
) -> None:
    """Draw a recorded game as a GIF.

    Example: racecraft snakes gif game.jsonl game.gif
    """
    from racecraft.evaluation.arena.record import read_record
    from racecraft.evaluation.arena.view import write_gif

    write_gif(read_record(game), picture, fps)
    print(picture)
