"""`racecraft unity`: Unity scenes on the same loop."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from racecraft.cli.option_groups import option_names, takes_groups
from racecraft.cli.output import word
from racecraft.cli.training import Left, Road, TrainingOptions, verdict

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.unity.training.plan import UnityRequest

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


@dataclass(frozen=True)
class SceneOptions:
    """What of a scene learns, and how its player runs."""

    config: Annotated[Path | None, typer.Option(help="ML-Agents' trainer configuration, the YAML file.")] = None
    behavior: Annotated[
        str | None,
        typer.Option(help="Which behavior learns; by default those of the configuration, or all of the scene."),
    ] = None
    max_agents: Annotated[
        int | None, typer.Option(min=1, help="Agents of a behavior that live at once; by default those that ask first.")
    ] = None
    graphics: Annotated[bool | None, typer.Option("--graphics/--no-graphics", help="Let the player open a window.")] = (
        None
    )
    num_envs: Annotated[
        int | None, typer.Option(min=1, help="Players that teach side by side; by default the configuration's, or 1.")
    ] = None
    time_scale: Annotated[
        float | None, typer.Option(help="Simulated seconds a second; by default the configuration's, or 20.")
    ] = None
    base_port: Annotated[
        int | None,
        typer.Option(
            min=1, max=65535, help="The first player's port, the others' follow; by default whichever are free."
        ),
    ] = None
    nearest: Annotated[
        bool,
        typer.Option(
            "--nearest", help="Let PPO learn where the configuration asks for POCA, self-play or SAC of choices."
        ),
    ] = False
    env_args: Annotated[
        list[str] | None,
        typer.Option(ENV_ARGS, metavar="WORDS …", help="Arguments for the player: all words that follow."),
    ] = None


@dataclass(frozen=True)
class UnityTraining(TrainingOptions):
    """What a training in a scene is asked."""

    stop: Annotated[
        list[str] | None,
        typer.Option(help="score=0.92, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/BEHAVIOR-N.")] = None
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the learner and the player; by default the configuration's, or 1.")
    ] = None


@app.command(cls=TakesEnvArgs)
@takes_groups
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
    *,
    scene: SceneOptions,
    options: UnityTraining,
    inference: Annotated[
        bool, typer.Option("--inference", help="Learn nothing; let what --from (or --run --resume) names play.")
    ] = False,
) -> None:
    """Train the agents of a Unity scene.

    Examples:

        racecraft unity train builtin:Basic

        racecraft unity train builds/Game.x86_64 --config Game.yaml --stop minutes=60

        racecraft unity train builds/Game --num-envs 4 --base-port 5005 --env-args --level 2

        racecraft unity train --run runs/Basic-1 --resume --stop minutes=10

        racecraft unity train --from runs/Basic-1 --inference
    """

    def request() -> UnityRequest:
        return _request(build, scene, options, options.source())

    if inference:
        return _play(build, scene, options)
    road = Road("unity", "runs/Basic-1", ("build", *option_names(SceneOptions)), model=scene.behavior)
    road.train(context, options, request, _tell_trained)


def _request(build: str | None, scene: SceneOptions, options: UnityTraining, source: str | None) -> UnityRequest:
    from racecraft.worlds.unity.training.plan import UnityRequest

    return UnityRequest(
        build,
        scene.config,
        scene.behavior,
        scene.graphics,
        scene.max_agents,
        tuple(scene.env_args or ()),
        scene.num_envs,
        scene.time_scale,
        scene.nearest,
        scene.base_port,
        **options.asked(source),
    )


def _play(build: str | None, scene: SceneOptions, options: UnityTraining) -> None:
    """Let a policy play, which learns nothing.

    Raises:
        SettingError: What plays is to be a job, or to be mirrored.
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.unity.training.inference import play_scene

    if options.detach:
        raise SettingError("--inference and --detach were given; expected one of them: what plays, is played here.")
    if options.mirror is not None:
        raise SettingError("--inference and --mirror were given; expected one of them: what plays leaves no run.")
    source = f"{options.run}:last" if options.resume and options.run is not None else options.source()
    played = play_scene(_request(build, scene, options, source), options.tell)
    print_json(played) if options.json else _tell_played(played)


def _tell_played(played: dict[str, Any]) -> None:
    mean = "" if played["mean_return"] is None else f"mean return {played['mean_return']:.3f} over "
    print(f"{mean}{played['episodes']} episodes in {played['seconds']:.1f} s; stopped: {played['stopped_by']}")


def _tell_trained(trained: Trained, left: Left) -> None:
    from racecraft.worlds.unity.export.unity_run import can_export_to_unity

    summary = trained.summary()
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps and {summary['seconds']:.1f} s"
    if judged is None:
        print(f"{summary['behavior']}: not judged this time; after {steps}; run: {summary['run']}")
        return
    told = f"{verdict(summary)}mean return {judged['mean_return']:.3f} over {judged['episodes']} episodes"
    print(f"{summary['behavior']}: {told} after {steps}; run: {summary['run']}")
    for name, told in judged.get("behaviors", {}).items():
        print(f"  {name}: mean return {told['mean_return']:.3f} over {told['episodes']} episodes")
    if can_export_to_unity(trained.run.path):
        print(f"Back into Unity: racecraft export {word(trained.run.path)} --to unity")
