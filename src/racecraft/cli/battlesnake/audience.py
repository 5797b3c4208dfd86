"""Who watches a game while it is played: a terminal, a browser, a protocol, or only the clock that keeps the pace."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from racecraft.envs.battlesnake.board import Board
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.players.battlesnake.messages import GameCard
    from racecraft.serving.board_server import BoardServer

SECONDS_FOR_A_BROWSER = 30.0
"""How long a game that is over waits for a browser that has not come yet."""


class Watcher(Protocol):
    """Whoever is shown every position."""

    def show(self, board: Board, card: GameCard) -> None:
        """See a position."""

    def leave(self, finished: bool) -> None:
        """See no more: the game is finished, or was broken off and nothing is waited for."""


class Terminal:
    """Draws each position over the one before it.

    Args:
        colour: True: colours, also where standard output is no terminal; False: letters; None: colours where possible.
    """

    def __init__(self, colour: bool | None) -> None:
        from rich.console import Console
        from rich.live import Live

        console = Console(force_terminal=True) if colour else Console(no_color=True if colour is False else None)
        self._colour = console.color_system is not None if colour is None else colour
        self._live = Live(console=console, auto_refresh=False, transient=False)
        self._live.start()

    def show(self, board: Board, card: GameCard) -> None:
        """Draw a position."""
        from racecraft.analysis.battlesnake.board_picture import as_text

        self._live.update(as_text(board, card, self._colour), refresh=True)

    def leave(self, finished: bool) -> None:
        """Leave the last position standing."""
        self._live.stop()


@dataclass(frozen=True)
class Showing:
    """How a page comes to whoever wants to see it."""

    board_url: str = ""
    """A board page that speaks the official protocol; "": our own page."""
    port: int = 0
    open_it: bool = True
    speed: float = 8
    """Turns a second at which our page begins."""
    stays: bool = False
    """Whether the game stays there until Ctrl-C, or only until a browser has it."""
    json: bool = False

    def begin(self, server: BoardServer, game_id: str) -> None:
        """Serve, say where, and open the page if that is wanted."""
        from racecraft.cli.output import print_json, say

        address = page_address(server.start(self.port), self.board_url, game_id)
        if self.json and self.stays:
            print_json({"url": address})
        else:
            say(f"Watch it at {address}{' (Ctrl-C ends)' * self.stays}", quiet_stdout=self.json)
        if self.open_it:  # aside: a browser of the terminal keeps its caller waiting until it is closed
            threading.Thread(target=_open_page, args=(address,), daemon=True).start()

    def hold(self, server: BoardServer, game_id: str) -> None:
        """Show a game that is known to its end, until Ctrl-C."""
        try:
            with suppress(KeyboardInterrupt):
                self.begin(server, game_id)
                _stay()
        finally:
            server.close()

    def end(self, server: BoardServer) -> None:
        """Wait until Ctrl-C, or until a browser has the whole game; then serve no more."""
        from racecraft.cli.output import say

        try:
            with suppress(KeyboardInterrupt):
                if self.stays:
                    _stay()
                elif not server.wait_for_viewer(SECONDS_FOR_A_BROWSER):
                    say(f"No browser came within {SECONDS_FOR_A_BROWSER:g} s.", quiet_stdout=True)
        finally:
            server.close()


class Browser:
    """Serves a game on this machine while it is played, and opens a page that shows it."""

    def __init__(self, settings: GameSettings, showing: Showing) -> None:
        self._settings, self._showing = settings, showing
        self._server: BoardServer | None = None
        self._card: GameCard | None = None

    def show(self, board: Board, card: GameCard) -> None:
        """Pass a position on; with the first one the page is opened."""
        from racecraft.analysis.battlesnake.board_frames import frame, game_facts, title_of
        from racecraft.serving.board_server import BoardServer

        if self._server is None:
            title = title_of(card)
            self._card = card
            self._server = BoardServer(title, game_facts(self._settings, card), speed=self._showing.speed)
            self._showing.begin(self._server, card.id)
        self._server.add(frame(board, card))

    def leave(self, finished: bool) -> None:
        """Let whoever watches have the end."""
        from racecraft.analysis.battlesnake.board_frames import game_end

        if self._server is None or self._card is None:
            return
        if finished:
            self._server.add(game_end(self._settings, self._card))
            self._showing.end(self._server)
        else:
            self._server.close()


class Pace:
    """Keeps the time of a turn.

    Args:
        delay_seconds: Waited after each turn.
        least_seconds: What a turn lasts at least.
    """

    def __init__(self, delay_seconds: float, least_seconds: float) -> None:
        self._delay, self._least = delay_seconds, least_seconds
        self._shown_at = 0.0

    def show(self, board: Board, card: GameCard) -> None:
        """Wait as long as is left of the turn."""
        rest = self._shown_at + self._least - time.monotonic()
        if board.turn > 0 and max(rest, self._delay) > 0:
            time.sleep(max(rest, self._delay))
        self._shown_at = time.monotonic()

    def leave(self, finished: bool) -> None:
        """Nothing to do."""


class Protocolist:
    """Says every turn, on standard error, who was asked, what came of it and how long it took."""

    def __init__(self) -> None:
        self._before: Board | None = None

    def show(self, board: Board, card: GameCard) -> None:
        """Say a turn."""
        from racecraft.cli.output import say

        parts = []
        for snake in board.snakes if self._before is not None else []:
            name = card.names.get(snake.id, snake.id)
            if snake.alive or snake.on == board.turn:
                fate = "" if snake.alive else f" ({snake.cause})"
                parts.append(f"{name} to {snake.head[0]},{snake.head[1]} in {card.latencies_ms[snake.id]} ms{fate}")
        self._before = board
        if parts:
            say(f"turn {board.turn}: {'; '.join(parts)}", quiet_stdout=True)

    def leave(self, finished: bool) -> None:
        """Nothing to do."""


def page_address(server: str, board_url: str, game_id: str) -> str:
    """Return where a game is watched: our own page, or a board page told of engine and game, as the official CLI does.

    >>> page_address("http://127.0.0.1:5000", "https://board.example/", "g1")
    'https://board.example/?engine=http%3A%2F%2F127.0.0.1%3A5000&game=g1&autoplay=true'
    """
    from urllib.parse import urlencode

    if not board_url:
        return f"{server}/"
    asked = urlencode({"engine": server, "game": game_id, "autoplay": "true"})
    return f"{board_url.rstrip('/')}/{'&' if '?' in board_url else '?'}{asked}"


def _stay() -> None:
    while True:
        time.sleep(3600)


def _open_page(address: str) -> None:
    import webbrowser

    from racecraft.cli.output import say

    if not webbrowser.open(address):
        say("No browser could be opened; open that address yourself.", quiet_stdout=True)
