"""`racecraft record`: let a trained policy show what it does, for others to learn from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.named_run import RUN_HELP
from racecraft.cli.options import Json


def record(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write.")] = Path("demos.safetensors"),
    episodes: Annotated[int, typer.Option(min=1, help="Whole episodes to record.")] = 20,
    sampled: Annotated[
        bool, typer.Option("--sampled", help="Draw actions by the policy's probabilities, not the likeliest.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Of the world and of draws.")] = 0,
    json: Json = False,
) -> None:
    """Record what a trained policy sees and does in the world it was trained in.

    Behavioural cloning learns from the file:

        racecraft record runs/CartPole-v1-1 --output demos.safetensors

        racecraft gym train CartPole-v1 --algorithm bc --set bc.demonstrations=demos.safetensors
    """
    from racecraft.cli.output import print_json, say
    from racecraft.formats.demonstrations import write_demonstrations
    from racecraft.training.demonstrating import record_run

    shown = record_run(run, episodes, seed=seed, sampled=sampled, say=lambda text: say(text, quiet_stdout=json))
    write_demonstrations(output, shown)
    returns = shown.returns
    if json:
        print_json(
            {
                "file": str(output),
                "episodes": shown.num_episodes,
                "ticks": len(shown),
                "mean_return": float(returns.mean()),
                "source": dict(shown.source),
            }
        )
        return
    print(f"{output}: {shown.num_episodes} episodes, {len(shown)} ticks, mean return {returns.mean():.1f}")
