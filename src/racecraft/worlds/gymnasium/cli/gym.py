"""`racecraft gym`: any Gymnasium environment on the same loop."""

from __future__ import annotations

import typer

from racecraft.actions.train_run import TrainedRun
from racecraft.cli.train import train_command, verdict
from racecraft.worlds.gymnasium.actions.train import train

app = typer.Typer(help="Train on any registered Gymnasium environment.", no_args_is_help=True)


@app.callback()
def gym() -> None:
    """Train on any registered Gymnasium environment."""


def _show(trained: TrainedRun) -> None:
    summary = trained.summary()
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps; run: {trained.run.path}"
    if judged is None:
        print(f"{summary['environment']}: stopped before its first evaluation, after {steps}")
        return
    score = f"{verdict(summary)}mean return {judged['mean_return']:.1f} over {judged['episodes']} greedy episodes"
    print(f"{summary['environment']}: {score} after {steps}")


app.command("train")(train_command(train, _show))
