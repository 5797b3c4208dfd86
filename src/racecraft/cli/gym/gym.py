"""`racecraft gym`: any Gymnasium environment on the same loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.buckets.training import MirrorAt
from racecraft.cli.metrics_beside import MetricsPort, measured
from racecraft.cli.options import DEFAULT, AlgorithmName, Cluster, Detach, From, Json, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes
from racecraft.cli.runs.report import Pictures, leave_report
from racecraft.contract.errors import SettingError

UNCHANGEABLE = ("environment", "seed", "algorithm", "set_", "from_")

app = typer.Typer(help="Train on any registered Gymnasium environment.", no_args_is_help=True)


@app.callback()
def gym() -> None:
    """Train on any registered Gymnasium environment."""


@app.command()
def train(
    context: typer.Context,
    environment: Annotated[
        str | None, typer.Argument(metavar="ID", help="A registered id, such as CartPole-v1.")
    ] = None,
    stop: Annotated[
        list[str] | None,
        typer.Option(help="score=475, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/ID-N.")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same machine, same training.")] = 1,
    algorithm: AlgorithmName = DEFAULT,
    set_: Overrides = None,
    from_: From = None,
    resume: Resume = False,
    detach: Detach = False,
    cluster: Cluster = None,
    mirror: MirrorAt = None,
    metrics_port: MetricsPort = None,
    pictures: Pictures = True,
    json: Json = False,
) -> None:
    """Train until the environment is solved.

    Examples:

        racecraft gym train CartPole-v1

        racecraft gym train Pendulum-v1 --stop score=-200 --stop minutes=5

        racecraft gym train --run runs/CartPole-v1-1 --resume --stop minutes=5
    """
    from racecraft.cli.buckets.training import fetch_run, mirrored, place_of_mirror
    from racecraft.cli.jobs.detaching import detach_training
    from racecraft.cli.output import print_json, say
    from racecraft.cluster.spreading import spread_over
    from racecraft.training.gymnasium.trainer import GymRequest
    from racecraft.training.progress import watcher
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    spread = spread_over(cluster)
    begun = refuse_changes(context, run, UNCHANGEABLE, "runs/CartPole-v1-1") if resume else None
    place, request = place_of_mirror(mirror, None, begun, tell), None
    if begun is None:
        if environment is None:
            raise SettingError("no environment is named; expected ID, such as: racecraft gym train CartPole-v1")
        source = None if from_ is None else fetch_run(from_, tell)
        request = GymRequest(environment, **asked(algorithm, stop, run, seed, set_, source))
    shown = watcher(sys.stderr if json else sys.stdout)
    watching = measured(shown, metrics_port, run.name if run is not None else environment, tell, detach)
    if detach:
        return detach_training(context, run, request, json)
    with mirrored(watching, place, tell, begun) as mirroring:
        if begun is not None:
            trained = resume_run(begun, tuple(stop or ()), mirroring, tell, "gymnasium", spread)
        else:
            assert request is not None
            trained = train_world(request, mirroring, tell, spread)
        summary, files = trained.summary(), leave_report(trained.run.path, tell) if pictures else {}
    if json:
        print_json({**summary, **files})
        return
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps; run: {trained.run.path}"
    if judged is None:
        print(f"{summary['environment']}: stopped before its first evaluation, after {steps}")
        return
    verdict = "solved" if summary["solved"] else "not solved"
    mean, episodes = judged["mean_return"], judged["episodes"]
    print(f"{summary['environment']}: {verdict}, mean return {mean:.1f} over {episodes} greedy episodes after {steps}")
