"""`racecraft unity`: Unity scenes on the same loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import DEFAULT, AlgorithmName, From, Json, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes

UNCHANGEABLE = ("build", "config", "behavior", "max_agents", "seed", "algorithm", "set_", "graphics", "from_")

app = typer.Typer(help="Train in Unity scenes built with ML-Agents.", no_args_is_help=True)


@app.callback()
def unity() -> None:
    """Train in Unity scenes built with ML-Agents."""


@app.command()
def train(
    context: typer.Context,
    build: Annotated[
        str | None,
        typer.Argument(
            metavar="BUILD",
            help="A build's file, folder or zip, registry:NAME, editor, or builtin:Basic; by default the "
            "configuration's env_path.",
        ),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="ML-Agents' trainer configuration, the YAML file.")] = None,
    behavior: Annotated[
        str | None,
        typer.Option(help="Which behavior learns; by default those of the configuration, or all of the scene."),
    ] = None,
    max_agents: Annotated[
        int | None, typer.Option(min=1, help="Agents of a behavior that live at once; by default those that ask first.")
    ] = None,
    stop: Annotated[
        list[str] | None,
        typer.Option(help="score=0.92, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/BEHAVIOR-N.")] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the learner and the player; by default the configuration's, or 1.")
    ] = None,
    algorithm: AlgorithmName = DEFAULT,
    set_: Overrides = None,
    graphics: Annotated[
        bool | None, typer.Option("--graphics/--no-graphics", help="Let the player open a window.")
    ] = None,
    from_: From = None,
    resume: Resume = False,
    json: Json = False,
) -> None:
    """Train the agents of a Unity scene.

    Examples:

        racecraft unity train builtin:Basic

        racecraft unity train builds/Game.x86_64 --config Game.yaml --stop minutes=60

        racecraft unity train --run runs/Basic-1 --resume --stop minutes=10
    """
    from racecraft.cli.output import print_json, say
    from racecraft.cli.runs.report import leave_report
    from racecraft.training.progress import watcher
    from racecraft.training.unity.plan import UnityRequest
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    stops, watching = tuple(stop or ()), watcher(sys.stderr if json else sys.stdout)
    if resume:
        begun = refuse_changes(context, run, UNCHANGEABLE, "runs/Basic-1")
        trained = resume_run(begun, stops, watching, tell, "unity")
    else:
        request = UnityRequest(
            build,
            config,
            behavior,
            graphics,
            max_agents,
            **asked(algorithm, stop, run, seed, set_, from_),
        )
        trained = train_world(request, watching, tell)
    summary, files = trained.summary(), leave_report(trained.run.path, tell)
    if json:
        print_json({**summary, **files})
        return
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps and {summary['seconds']:.1f} s"
    if judged is None:
        print(f"{summary['behavior']}: not judged this time; after {steps}; run: {trained.run.path}")
        return
    verdict = "" if judged["threshold"] is None else ("solved, " if summary["solved"] else "not solved, ")
    print(
        f"{summary['behavior']}: {verdict}mean return {judged['mean_return']:.3f} over {judged['episodes']} episodes "
        f"after {steps}; run: {trained.run.path}"
    )
    for name, told in judged.get("behaviors", {}).items():
        print(f"  {name}: mean return {told['mean_return']:.3f} over {told['episodes']} episodes")
    print(f"Back into Unity: racecraft export {trained.run.path} --to unity")
