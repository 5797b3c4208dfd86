"""`racecraft unity`: Unity scenes on the same loop."""

from __future__ import annotations

import typer
from typer.core import TyperCommand

from racecraft.actions.figures import Figures
from racecraft.actions.train_run import TrainedRun
from racecraft.cli.output import word
from racecraft.cli.train import train_command, verdict
from racecraft.worlds.unity.actions.train import ENV_ARGS, train


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


def _show(done: TrainedRun | Figures) -> None:
    _show_trained(done) if isinstance(done, TrainedRun) else _show_played(done)


def _show_played(played: Figures) -> None:
    mean = "" if played["mean_return"] is None else f"mean return {played['mean_return']:.3f} over "
    print(f"{mean}{played['episodes']} episodes in {played['seconds']:.1f} s; stopped: {played['stopped_by']}")


def _show_trained(trained: TrainedRun) -> None:
    from racecraft.worlds.unity.export.unity_run import can_export_to_unity

    summary = trained.summary()
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps and {summary['seconds']:.1f} s"
    if judged is None:
        print(f"{summary['behavior']}: not judged this time; after {steps}; run: {summary['run']}")
        return
    text = f"{verdict(summary)}mean return {judged['mean_return']:.3f} over {judged['episodes']} episodes"
    print(f"{summary['behavior']}: {text} after {steps}; run: {summary['run']}")
    for name, text in judged.get("behaviors", {}).items():
        print(f"  {name}: mean return {text['mean_return']:.3f} over {text['episodes']} episodes")
    if can_export_to_unity(trained.run.path):
        print(f"Back into Unity: racecraft export {word(trained.run.path)} --to unity")


app.command("train", cls=TakesEnvArgs)(train_command(train, _show))
