"""Who watches a game while it is played: a terminal, or a browser to whom it is served on this machine."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from urllib.parse import urlencode

from racecraft.serving.interrupts import wait_for_interrupt
from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts, title_of
from racecraft.worlds.battlesnake.analysis.board_picture import as_text
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import GameCard
from racecraft.worlds.battlesnake.serving.board_server import BoardServer

SECONDS_FOR_A_BROWSER = 30.0
"""How long a game that is over waits for a browser that has not come yet."""


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
        self._live.update(as_text(board, card, self._colour), refresh=True)

    def leave(self, finished: bool) -> None:
        """Leave the last position standing."""
        self._live.stop()


@dataclass(frozen=True)
class BoardPage:
    """How a page comes to whoever wants to see it."""

    board_url: str = ""
    """A board page that speaks the official protocol; "": our own page."""
    port: int = 0
    open_it: bool = True
    speed: float = 8
    """Turns a second at which our page begins."""
    stays: bool = False
    """Whether the game stays there until Ctrl-C, or only until a browser has it."""
    announce: Callable[[str], None] = print
    """Told the address of the page."""
    on_message: Callable[[str], None] = print
    """Told, in a sentence, what a person should know besides."""

    def begin(self, server: BoardServer, game_id: str) -> None:
        """Serve, say where, and open the page if that is wanted."""
        address = page_address(server.start(self.port), self.board_url, game_id)
        self.announce(address)
        if self.open_it:  # aside: a browser of the terminal keeps its caller waiting until it is closed
            threading.Thread(target=_open_page, args=(address, self.on_message), daemon=True).start()

    def show_until_interrupt(self, server: BoardServer, game_id: str) -> None:
        """Show a game that is known to its end, until Ctrl-C."""
        try:
            with suppress(KeyboardInterrupt):
                self.begin(server, game_id)
                wait_for_interrupt()
        finally:
            server.close()

    def end(self, server: BoardServer) -> None:
        """Wait until Ctrl-C, or until a browser has the whole game; then serve no more."""
        try:
            with suppress(KeyboardInterrupt):
                if self.stays:
                    wait_for_interrupt()
                elif not server.wait_for_viewer(SECONDS_FOR_A_BROWSER):
                    self.on_message(f"No browser came within {SECONDS_FOR_A_BROWSER:g} s.")
        finally:
            server.close()


class Browser:
    """Serves a game on this machine while it is played, and opens a page that shows it."""

    def __init__(self, settings: GameSettings, showing: BoardPage) -> None:
        self._settings, self._showing = settings, showing
        self._server: BoardServer | None = None
        self._card: GameCard | None = None

    def show(self, board: Board, card: GameCard) -> None:
        """Pass a position on; with the first one the page is opened."""
        if self._server is None:
            title = title_of(card)
            self._card = card
            self._server = BoardServer(title, game_facts(self._settings, card), speed=self._showing.speed)
            self._showing.begin(self._server, card.id)
        self._server.add(frame(board, card))

    def leave(self, finished: bool) -> None:
        """Let whoever watches have the end."""
        if self._server is None or self._card is None:
            return
        if finished:
            self._server.add(game_end(self._settings, self._card))
            self._showing.end(self._server)
        else:
            self._server.close()


def page_address(server: str, board_url: str, game_id: str) -> str:
    """Return where a game is watched: our own page, or a board page told of engine and game, as the official CLI does.

    >>> page_address("http://127.0.0.1:5000", "https://board.example/", "g1")
    'https://board.example/?engine=http%3A%2F%2F127.0.0.1%3A5000&game=g1&autoplay=true'
    """
    if not board_url:
        return f"{server}/"
    query = urlencode({"engine": server, "game": game_id, "autoplay": "true"})
    return f"{board_url.rstrip('/')}/{'&' if '?' in board_url else '?'}{query}"


def _open_page(address: str, on_message: Callable[[str], None]) -> None:
    if not webbrowser.open(address):
        on_message("No browser could be opened; open that address yourself.")
