"""`racecraft unity`: Unity scenes on the same loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from racecraft.cli.buckets.training import MirrorAt
from racecraft.cli.metrics_beside import MetricsPort, measured
from racecraft.cli.options import DEFAULT, AlgorithmName, Detach, From, Json, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes

UNCHANGEABLE = (
    "build", "config", "behavior", "max_agents", "seed", "algorithm", "set_", "graphics", "from_", "env_args",
    "num_envs", "time_scale", "base_port",
)  # fmt: skip
ENV_ARGS = "--env-args"


class TakesEnvArgs(TyperCommand):
    """A command whose `--env-args` takes all words that follow, as `mlagents-learn`'s does."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Hand on each of those words as an option of its own."""
        if ENV_ARGS in args:
            at = args.index(ENV_ARGS)
            args = args[:at] + [f"{ENV_ARGS}={word}" for word in args[at + 1 :]]
        return super().parse_args(ctx, args)


app = typer.Typer(help="Train in Unity scenes built with ML-Agents.", no_args_is_help=True)


@app.callback()
def unity() -> None:
    """Train in Unity scenes built with ML-Agents."""


@app.command(cls=TakesEnvArgs)
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
    num_envs: Annotated[
        int | None, typer.Option(min=1, help="Players that teach side by side; by default the configuration's, or 1.")
    ] = None,
    time_scale: Annotated[
        float | None, typer.Option(help="Simulated seconds a second; by default the configuration's, or 20.")
    ] = None,
    base_port: Annotated[
        int | None,
        typer.Option(
            min=1, max=65535, help="The first player's port, the others' follow; by default whichever are free."
        ),
    ] = None,
    inference: Annotated[
        bool, typer.Option("--inference", help="Learn nothing; let what --from (or --run --resume) names play.")
    ] = False,
    env_args: Annotated[
        list[str] | None,
        typer.Option(ENV_ARGS, metavar="WORDS …", help="Arguments for the player: all words that follow."),
    ] = None,
    from_: From = None,
    resume: Resume = False,
    detach: Detach = False,
    mirror: MirrorAt = None,
    metrics_port: MetricsPort = None,
    json: Json = False,
) -> None:
    """Train the agents of a Unity scene.

    Examples:

        racecraft unity train builtin:Basic

        racecraft unity train builds/Game.x86_64 --config Game.yaml --stop minutes=60

        racecraft unity train builds/Game --num-envs 4 --base-port 5005 --env-args --level 2

        racecraft unity train --run runs/Basic-1 --resume --stop minutes=10

        racecraft unity train --from runs/Basic-1 --inference
    """
    from racecraft.cli.buckets.training import fetch_run, mirrored, place_of_mirror
    from racecraft.cli.jobs.detaching import detach_training
    from racecraft.cli.output import print_json, say
    from racecraft.cli.runs.report import leave_report
    from racecraft.export.unity_run import can_export_to_unity
    from racecraft.training.progress import watcher
    from racecraft.training.unity.plan import UnityRequest
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    def request(source: str | None) -> UnityRequest:
        return UnityRequest(
            build,
            config,
            behavior,
            graphics,
            max_agents,
            tuple(env_args or ()),
            num_envs,
            time_scale,
            base_port,
            **asked(algorithm, stop, run, seed, set_, source),
        )

    from_ = None if from_ is None else fetch_run(from_, tell)
    if inference:
        from racecraft.contract.errors import SettingError
        from racecraft.training.unity.inference import play_scene

        if detach:
            raise SettingError("--inference and --detach were given; expected one of them: what plays, is played here.")
        if mirror is not None:
            raise SettingError("--inference and --mirror were given; expected one of them: what plays leaves no run.")
        played = play_scene(request(f"{run}:last" if resume and run is not None else from_), tell)
        print_json(played) if json else _tell_played(played)
        return
    begun = refuse_changes(context, run, UNCHANGEABLE, "runs/Basic-1") if resume else None
    place = place_of_mirror(mirror, None, begun, tell)
    shown = watcher(sys.stderr if json else sys.stdout)
    watching = measured(shown, metrics_port, run.name if run is not None else behavior, tell, detach)
    if detach:
        return detach_training(context, run, None if begun is not None else request(from_), json)
    with mirrored(watching, place, tell, begun) as mirroring:
        if begun is not None:
            trained = resume_run(begun, tuple(stop or ()), mirroring, tell, "unity")
        else:
            trained = train_world(request(from_), mirroring, tell)
        summary, files = trained.summary(), leave_report(trained.run.path, tell)
    if json:
        print_json({**summary, **files})
        return
    _tell_trained(summary)
    if summary["evaluation"] is not None and can_export_to_unity(trained.run.path):
        print(f"Back into Unity: racecraft export {trained.run.path} --to unity")


def _tell_played(played: dict[str, Any]) -> None:
    mean = "" if played["mean_return"] is None else f"mean return {played['mean_return']:.3f} over "
    print(f"{mean}{played['episodes']} episodes in {played['seconds']:.1f} s; stopped: {played['stopped_by']}")


def _tell_trained(summary: dict[str, Any]) -> None:
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps and {summary['seconds']:.1f} s"
    if judged is None:
        print(f"{summary['behavior']}: not judged this time; after {steps}; run: {summary['run']}")
        return
    verdict = "" if judged["threshold"] is None else ("solved, " if summary["solved"] else "not solved, ")
    print(
        f"{summary['behavior']}: {verdict}mean return {judged['mean_return']:.3f} over {judged['episodes']} episodes "
        f"after {steps}; run: {summary['run']}"
    )
    for name, told in judged.get("behaviors", {}).items():
        print(f"  {name}: mean return {told['mean_return']:.3f} over {told['episodes']} episodes")
