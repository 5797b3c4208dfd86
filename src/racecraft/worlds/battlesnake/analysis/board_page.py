"""A game of snakes as one web page: step, play, scrub; nothing is fetched, so it can be e-mailed.

The page itself is `board_page.html`, with a place for the data: the events of `board_frames.py`, or the address of the
WebSocket from which they come while the game is played.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from racecraft.worlds.battlesnake.analysis.board_frames import Event
from racecraft.worlds.battlesnake.analysis.page_head import with_head

SOURCES = "'self' ws://127.0.0.1:* ws://localhost:*"
"""A game that is played is told over a WebSocket."""


def board_page(title: str, game: dict[str, Any], events: Sequence[Event] = (), live: str = "", speed: float = 8) -> str:
    """Return the page.

    Args:
        title: Its headline.
        game: `board_frames.game_facts`.
        events: What is known of the game already.
        live: Path of the WebSocket that has all events, on the server the page comes from; "" where `events` are all.
        speed: Turns a second at which it begins to play.
    """
    told = {"title": title, "game": game, "events": list(events), "live": live, "speed": speed}
    data = json.dumps(told, separators=(",", ":")).replace("<", "\\u003c")
    return with_head("board_page.html", title, SOURCES).replace('"__DATA__"', data)
