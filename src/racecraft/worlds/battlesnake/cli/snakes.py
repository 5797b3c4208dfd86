"""`racecraft snakes`: play, judge, watch and serve Battlesnakes; every verb has a file beside this one."""

from __future__ import annotations

import typer

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.players import BuiltInPlayers, list_players
from racecraft.worlds.battlesnake.actions.verify import Verified, verify
from racecraft.worlds.battlesnake.cli import arena as snakes_arena
from racecraft.worlds.battlesnake.cli import import_game as snakes_import
from racecraft.worlds.battlesnake.cli import play as snakes_play
from racecraft.worlds.battlesnake.cli import serve as snakes_serve
from racecraft.worlds.battlesnake.cli import study as snakes_study
from racecraft.worlds.battlesnake.cli import tournament as snakes_tournament
from racecraft.worlds.battlesnake.cli import train as snakes_train
from racecraft.worlds.battlesnake.cli import tune as snakes_tune
from racecraft.worlds.battlesnake.cli import watch as snakes_watch

app = typer.Typer(help="Battlesnake: train a snake, play games, hold tournaments, watch, serve.", no_args_is_help=True)


def _show_players(found: BuiltInPlayers) -> None:
    for name, what in found.players.items():
        print(f"{name:14} {what}")
    print("\nRUN            a snake you trained: runs/snakes-1, runs/snakes-1:last")
    print("search+NAME    search on top of another player, a RUN or a FILE.py")
    print("search:FILE    search by weights that `snakes tune` found: search:tuned.json")
    print("search:RUN     search that asks a trained snake about every position it comes to")
    print("FILE.py        your own: def move(data): …")


app.command("players")(command(list_players, _show_players))
app.command("play")(snakes_play.play)
app.command()(snakes_tournament.tournament)
app.add_typer(snakes_arena.app, name="arena")
app.command()(snakes_train.train)
app.command()(snakes_serve.serve)
app.command()(snakes_watch.watch)
app.command()(snakes_watch.film)
app.command()(snakes_watch.gif)


def _show_verified(done: Verified) -> None:
    report = done.report
    for example in report.examples:
        print(example + "\n")
    for sentence in report.unread:
        print(f"note: {sentence}")
    counts = {"game": report.games, "step": report.steps, "mismatch": report.mismatches}
    parts = (
        f"{count} {noun}{'' if count == 1 else 'es' if noun == 'mismatch' else 's'}" for noun, count in counts.items()
    )
    print(", ".join(parts), flush=True)


app.command()(command(verify, _show_verified))
app.command("import")(snakes_import.import_game)
app.command()(snakes_study.study)
app.command("tune")(snakes_tune.tune)
