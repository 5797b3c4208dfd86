"""`racecraft bench`."""

from __future__ import annotations

import typer

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.bench import bench_laps, bench_world


def _show_world(figures: Figures) -> None:
    for name, value in figures.items():
        print(f"{name:52} {value:>10,.0f}")


def _show_laps(figures: Figures) -> None:
    for name, value in figures.items():
        print(f"{name:36} {value}")


app = typer.Typer(help="Measure this machine; run it when nothing else runs.", no_args_is_help=True)
app.command("world")(command(bench_world, _show_world))
app.command("laps")(command(bench_laps, _show_laps))
