"""`racecraft bench`: how fast this machine is."""

from __future__ import annotations

from typing import Annotated

import typer

app = typer.Typer(help="Measure this machine; run it when nothing else runs.", no_args_is_help=True)

JSON = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]


@app.command()
def world(json: JSON = False) -> None:
    """Ticks per second of 64 cars: physics, every reward parameter and a 160x120 anti-aliased frame.

    Example: racecraft bench world --json
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.evaluation.bench_world import NUM_CARS, bench_world
    from racecraft.worlds.deepracer.training.trainer import load_reward

    say("Five rounds of three cases, about 20 s …", quiet_stdout=json)
    figures = bench_world(load_reward(None).copies(NUM_CARS))
    if json:
        print_json(figures)
        return
    for name, value in figures.items():
        print(f"{name:52} {value:>10,.0f}")


@app.command()
def laps(
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds, counted from 1.")] = 5,
    json: JSON = False,
) -> None:
    """Seconds from the first training tick to stable laps of the car of the preset fast on reinvent_base.

    Example: racecraft bench laps --seeds 3
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.training.bench_laps import bench_laps

    figures = bench_laps(range(1, seeds + 1), lambda text: say(text, quiet_stdout=json))
    if json:
        print_json(figures)
        return
    for name, value in figures.items():
        print(f"{name:36} {value}")
