"""A game of snakes as one web page: step, play, scrub. Begin with `board_page`, one file that can be e-mailed.

A server gives the same template (`BOARD`) `board_data`, with the path of the WebSocket from which events come while the
game is played.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.pages.render import render_file
from racecraft.worlds.battlesnake.analysis.board_frames import Event, frame, game_end, game_facts, title_of
from racecraft.worlds.battlesnake.evaluation.imported import read_game

BOARD = "racecraft.worlds.battlesnake.pages/board.html"
ARENA = "racecraft.worlds.battlesnake.pages/arena.html"


def board_page(title: str, game: dict[str, Any], events: Sequence[Event] = (), speed: float = 8) -> str:
    """Return the page as one file; arguments as `board_data`."""
    return render_file(BOARD, **board_data(title, game, events, speed=speed))


def read_board(game: Path) -> tuple[str, dict[str, Any], list[Event]]:
    """Return what a page shows of a recorded game: its headline, `game_facts`, and all events.

    Args:
        game: Of `snakes play --output`, or any file that `snakes import` reads.

    Raises:
        InputFileError: It is no such file.
    """
    played = read_game(game)
    events = [*(frame(board, played.card) for board in played.boards), game_end(played.settings, played.card)]
    return title_of(played.card), game_facts(played.settings, played.card, "complete"), events


def board_data(
    title: str, game: dict[str, Any], events: Sequence[Event] = (), live: str = "", speed: float = 8
) -> dict[str, Any]:
    """Return what the template BOARD names.

    Args:
        title: Its headline.
        game: `board_frames.game_facts`.
        events: What is known of the game already.
        live: Path of the WebSocket that has all events, on the server the page comes from; "" where `events` are all.
        speed: Turns a second at which it begins to play.
    """
    data = {"title": title, "game": game, "events": list(events), "live": live, "speed": speed}
    return {"title": title, "told": data}
