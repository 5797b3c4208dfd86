"""Whether a racer's folder trains."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class CheckRequest(Request):
    """Which folder is read."""

    folder: Path = argument("reward_function.py, hyperparameters.json, model_metadata.json; any may be absent.")
    trust_reward: bool = option(
        False,
        "Give the reward function all your rights: files, network, programs. Without it, it can compute, "
        "print and read files beside it.",
    )


@dataclass(frozen=True)
class Checked:
    """What a folder trains, and what its reward function says."""

    folder: Path
    track: str
    car: str
    algorithm: str
    notes: tuple[str, ...]
    """What is worth saying, a clause each."""
    rewards: dict[str, float]
    """What the reward function returned, by the moment it was asked about."""


@action
def check(request: CheckRequest, progress: Progress = quiet) -> Checked:
    """Read a folder as `train` does and call its reward function; train nothing. All faults are printed at once.

    Example: racecraft check my-car
    """
    from racecraft.worlds.deepracer.training.checking import check_folder

    checked = check_folder(request.folder, request.trust_reward)
    plan = checked.plan
    return Checked(
        request.folder, plan.track.name, plan.settings.race.car, plan.algorithm.name, plan.notes, checked.rewards
    )
