"""`racecraft snakes watch`, `film` and `gif`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.watch import FilmedGame, WatchedGame
from racecraft.worlds.battlesnake.actions.watch import film as film_action
from racecraft.worlds.battlesnake.actions.watch import gif as gif_action
from racecraft.worlds.battlesnake.actions.watch import watch as watch_action


def _show(game: WatchedGame) -> None:
    print(game.html or f"Watch it at {''.join(game.address)} (Ctrl-C ends)", flush=True)


def _show_film(done: FilmedGame) -> None:
    print(done.film)


watch = command(watch_action, _show)
film = command(film_action, _show_film)
gif = command(gif_action, _show_film)
