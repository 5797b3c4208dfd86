"""`racecraft snakes arena`."""

from __future__ import annotations

import shlex

import typer

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.arena import (
    HERE,
    NewArena,
    Players,
    Removed,
    add_players,
    export_games,
    new_arena,
    remove_players,
    show_arena,
)
from racecraft.worlds.battlesnake.actions.arena_play import ServedBoard, play_arena, show_board
from racecraft.worlds.battlesnake.cli.arena_text import print_standings, terms_text

app = typer.Typer(help="An arena that lasts: players come and go, games and ratings stay.", no_args_is_help=True)


def _show_new(made: NewArena) -> None:
    print(f"{made.arena}: {terms_text(made.terms)}; anchors {', '.join(made.anchors)}.")
    here = f" --arena {shlex.quote(str(made.arena))}" if made.arena != HERE else ""
    print(f"Let players in: racecraft snakes arena add search{here}")


def _show_added(added: Players) -> None:
    for one in added.players:
        print(f"{one['name']} is in: {one['source']}")


def _show_removed(done: Removed) -> None:
    for name in done.removed:
        print(f"{name} is drawn no more; its games stay.")


def _show_export(done: Figures) -> None:
    print(done["file"])


app.command("new")(command(new_arena, _show_new))
app.command("add")(command(add_players, _show_added))
app.command("remove")(command(remove_players, _show_removed))


def _show_board(board: ServedBoard) -> None:
    print(f"{board.arena}: {board.url}  (Ctrl-C ends)", flush=True)


app.command("play")(command(play_arena, print_standings, messages_aside=True))
app.command("board")(command(show_board, _show_board))
app.command("show")(command(show_arena, print_standings))
app.command("export")(command(export_games, _show_export))
