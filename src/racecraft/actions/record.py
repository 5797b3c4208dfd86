"""Record what a trained policy does, for others to learn from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.named_run import RUN_HELP
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class RecordRequest(Request):
    """What is recorded, and where it is written."""

    run: str = argument(RUN_HELP, metavar="RUN[:which]")
    output: Path = option(Path("demos.safetensors"), "The file to write.", "--output", "-o")
    episodes: int = option(20, "Whole episodes to record.", low=1)
    sampled: bool = option(False, "Draw actions by the policy's probabilities, not the likeliest.")
    seed: int = option(0, "Of the world and of draws.")


@dataclass(frozen=True)
class Recorded:
    """What was written."""

    file: Path
    episodes: int
    ticks: int
    mean_return: float
    source: dict[str, Any]
    """Run, checkpoint and world that it comes from."""


@action
def record(request: RecordRequest, progress: Progress = quiet) -> Recorded:
    """Record what a trained policy sees and does in the world it was trained in.

    Behavioural cloning learns from the file:

        racecraft record runs/CartPole-v1-1 --output demos.safetensors

        racecraft gym train CartPole-v1 --algorithm bc --set bc.demonstrations=demos.safetensors

    Raises:
        UserInputError: The run cannot be used, or the file cannot be written.
    """
    from racecraft.formats.demonstrations import write_demonstrations
    from racecraft.training.demonstrating import record_run

    recorded = record_run(
        request.run, request.episodes, seed=request.seed, sampled=request.sampled, on_message=progress
    )
    write_demonstrations(request.output, recorded)
    return Recorded(
        request.output, recorded.num_episodes, len(recorded), float(recorded.returns.mean()), dict(recorded.source)
    )
