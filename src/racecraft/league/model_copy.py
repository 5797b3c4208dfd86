"""A run at entry: what its policy needs is copied, nothing else. Begin with `copy_checkpoint`.

Neither the reward function nor the folders in which it was trained come along. A policy with classes of its owner's is
refused, since to load it would run that code.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.archive import Limits, members, unpack
from racecraft.formats.atomic import write_atomic
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.checkpoint_ranking import load_weights
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.training.custom_code import code_names

LIMITS = Limits(max_bytes=2 * 2**30, max_members=10_000)


def run_in_archive(archive: Path, place: Path, expected: str) -> RunFolder | None:
    """Unpack an archive of a run folder; None where it holds none.

    Args:
        archive: The file.
        place: An empty folder.
        expected: What is wanted, for messages.

    Raises:
        UserInputError: It is no archive, is larger than `LIMITS`, leads out of its folder, or holds several runs.
    """
    jobs = [member.path for member in members(archive, expected, LIMITS) if member.path.name == JOB]
    if not jobs:
        return None
    if len(jobs) > 1:
        raise SettingError("{archive} holds {count} run folders; expected one.", archive=archive, count=len(jobs))
    unpack(archive, place, expected, LIMITS)
    return RunFolder.open(place / jobs[0].parent)


def copy_checkpoint(
    run: RunFolder, which: str, folder: Path, job: Mapping[str, Any], files: Sequence[str] = ()
) -> None:
    """Make a run folder of one checkpoint of a run.

    Args:
        run: The run.
        which: Its checkpoint: best, last, N.
        folder: Becomes a run folder; does not exist yet.
        job: What its job.json says.
        files: Names of files that come along where the run has them.

    Raises:
        UserInputError: There is no such checkpoint, or its policy names code.
    """
    weights, card = load_weights(run, which)
    _require_no_code(run, card)

    def fill(copy: RunFolder) -> None:
        iteration, steps = int(card["iteration"]), int(card["steps"])
        Checkpoints(copy.checkpoints).save(iteration, steps, weights, card, best=True)
        for name in files:
            if (run.path / name).is_file():
                write_atomic(copy.path / name, (run.path / name).read_bytes())

    RunFolder.create(folder, dict(job), fill)


def _require_no_code(run: RunFolder, card: dict[str, Any]) -> None:
    """Refuse a policy that names classes of its owner's.

    Raises:
        SettingError: It does.
        PolicySpecError: It does not say what it is.
        RunFolderError: The checkpoint is of something else.
    """
    if not isinstance(card.get("policy_spec"), dict):
        raise RunFolderError(
            "{path}: its checkpoint does not say how its policy is built; expected one that racecraft wrote.",
            path=run.path,
        )
    names = list(code_names(PolicySpec.from_dictionary(card["policy_spec"])))
    if names:
        raise SettingError(
            "{path}: its policy brings code of its own ({names}); expected a policy of racecraft's own algorithms and "
            "networks. Races drive no code of racers.",
            path=run.path,
            names=", ".join(names),
        )
