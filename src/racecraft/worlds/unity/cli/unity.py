"""`racecraft unity`: Unity scenes on the same loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from racecraft.cli.from_request import TerminalProgress, takes_requests
from racecraft.cli.options import Json
from racecraft.cli.output import print_json, word
from racecraft.cli.training import Left, Road, verdict
from racecraft.settings.request import option_names
from racecraft.worlds.unity.actions.train import ENV_ARGS, SceneOptions, UnityTraining, play, unity_request

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.unity.training.plan import UnityRequest


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
@takes_requests
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
    tell = TerminalProgress(quiet_stdout=json)

    def request() -> UnityRequest:
        return unity_request(build, scene, options, options.source(tell))

    if inference:
        played = play(build, scene, options, tell)
        print_json(played) if json else _tell_played(played)
        return
    road = Road("unity", "runs/Basic-1", ("build", *option_names(SceneOptions)), model=scene.behavior)
    road.train(context, options, request, _tell_trained, json)


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
