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


def weights_of(plan: CarPlan) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the weights that `plan.request.clone_from` names, as tensors, and what is worth saying about them.

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
    return tensors, _notes_on_actions(plan, card)


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
    here, there = _actions(plan), card["model_metadata"]["action_space"]
    if len(here) != len(there):
        raise RunFolderError(
            f"{path}: was trained with {len(there)} actions, now there are {len(here)}; expected as many, since each "
            "output of the network is one action. Their angles and speeds may differ. Begin with that run's "
            "model_metadata.json."
        )


def _notes_on_actions(plan: CarPlan, card: dict[str, Any]) -> tuple[str, ...]:
    """Say which actions mean something else than they did when the weights learned them."""
    pairs = list(zip(_actions(plan), card["model_metadata"]["action_space"], strict=True))
    changed = [number for number, (now, then) in enumerate(pairs) if _pair(now) != _pair(then)]
    if not changed:
        return ()
    now, then = (_pair(action) for action in pairs[changed[0]])
    example = f"action {changed[0]} was {then[0]:g}° at {then[1]:g} m/s and is {now[0]:g}° at {now[1]:g} m/s"
    return (f"{len(changed)} of {len(pairs)} actions differ from those the weights were trained with: {example}",)


def _actions(plan: CarPlan) -> list[dict[str, float]]:
    actions: list[dict[str, float]] = as_aws_dict(plan.model.metadata)["action_space"]
    return actions


def _pair(action: dict[str, float]) -> tuple[float, float]:
    return action["steering_angle"], action["speed"]


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
