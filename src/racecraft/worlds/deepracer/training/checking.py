"""Whether a racer's folder trains, without training. Begin with `check_folder`."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import Faults
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.files.racer_files import find_racer_files
from racecraft.worlds.deepracer.files.reward_file import validate
from racecraft.worlds.deepracer.files.reward_source import RewardSource
from racecraft.worlds.deepracer.training.plan import CarPlan, RaceRequest, plan_car


@dataclass(frozen=True)
class CheckedFolder:
    """A folder that can be trained."""

    plan: CarPlan
    """The training that `racecraft train FOLDER` would begin."""
    rewards: dict[str, float]
    """What the reward function returns at made-up moments of a lap, by the moment's name; empty without one."""


def check_folder(folder: Path, trust_reward: bool = False) -> CheckedFolder:
    """Read every file of a folder, and call its reward function at made-up moments of a lap.

    Nothing is written and nothing is trained; what the reward function prints is dropped.

    Args:
        folder: The racer's.
        trust_reward: Whether the reward function keeps all the user's rights.

    Raises:
        UserInputError: The only fault.
        SeveralFaultsError: Every fault of every file.
    """
    faults = Faults()
    with faults.collect():
        plan = plan_car(RaceRequest(folder, trust_reward=trust_reward))
    if not faults.found:
        return CheckedFolder(plan, {} if plan.model.reward is None else _rewards(plan.model.reward, trust_reward))
    reported = {str(fault) for fault in faults.found}
    of_reward = Faults()
    with of_reward.collect():
        reward = find_racer_files(folder).reward if folder.is_dir() else None
        if reward is not None:
            _rewards(reward, trust_reward)
    faults.found += [fault for fault in of_reward.found if str(fault) not in reported]
    raise faults.error()


def _rewards(reward: Path | RewardSource, is_trusted: bool) -> dict[str, float]:
    with contextlib.closing(
        open_reward(reward, io.StringIO(), is_trusted=is_trusted)
    ) as process:  # as a training has it
        return validate(process)
