"""Begin a new training with the weights of an old one."""

from __future__ import annotations

from typing import Any

from racecraft.algorithms.weights import to_tensors
from racecraft.contract.errors import RunFolderError
from racecraft.formats.aws.model_metadata import as_aws_dict
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import as_dictionary, from_dictionary
from racecraft.training.deepracer.plan import KIND, CarPlan

MUST_MATCH = ("camera", "network")
"""Groups of settings that shape the weights."""


def weights_of(plan: CarPlan) -> dict[str, Any]:
    """Return the weights that `plan.request.clone_from` names, as tensors.

    The optimiser starts from zero and iterations are counted from zero, as when cloning at AWS.

    Raises:
        RunFolderError: No such run, or a car of another shape; the letter says what may not change.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    assert plan.request.clone_from is not None
    path, which = split_source(plan.request.clone_from)
    run = RunFolder.open(path)
    run.read_job_of(KIND)
    weights, card = Checkpoints(run.checkpoints).load_policy(which)
    _require_same_shape(plan, path, card)
    tensors: dict[str, Any] = to_tensors(weights)
    return tensors


def split_source(source: str) -> tuple[str, str]:
    """Return (run folder, checkpoint) of "RUN[:best|last|N]".

    >>> split_source("runs/oval-1:last"), split_source("runs/oval-1")
    (('runs/oval-1', 'last'), ('runs/oval-1', 'best'))
    """
    path, colon, which = source.rpartition(":")
    if colon and (which in ("best", "last") or which.isdigit()):
        return path, which
    return source, "best"


def _require_same_shape(plan: CarPlan, path: str, card: dict[str, Any]) -> None:
    """Refuse a clone whose network could not take the weights."""
    mine = as_dictionary(plan.settings)
    theirs = as_dictionary(
        from_dictionary(TrainSettings, card["settings"])
    )  # what an older card lacks is as by default
    for group in MUST_MATCH:
        for name, value in mine[group].items():
            if _plain(value) != _plain(theirs[group][name]):
                raise RunFolderError(
                    f"{path}: was trained with {group}.{name}={_plain(theirs[group][name])}, "
                    f"now it is {_plain(value)}; expected the same, for weights fit only the shape they were trained "
                    "in. "
                    f"Leave {group}.{name} as it was, or train afresh."
                )
    here, there = as_aws_dict(plan.model.metadata)["action_space"], card["model_metadata"]["action_space"]
    if here != there:
        raise RunFolderError(
            f"{path}: was trained with other actions ({_named(there)}) than those asked for ({_named(here)}); expected "
            "the same, since each output of the network is one action. Copy that run's model_metadata.json."
        )


def _named(space: Any) -> str:
    return "two ranges" if isinstance(space, dict) else f"a list of {len(space)}"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
