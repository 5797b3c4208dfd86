"""What must be alike where a car begins with the weights of an older run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.formats.aws.model_metadata import as_aws_dict
from racecraft.settings.overrides import as_dictionary, from_dictionary
from racecraft.training.deepracer.plan import CarPlan

MUST_MATCH = ("camera", "network")
"""Groups of settings that shape the weights."""


def require_same_shape(plan: CarPlan, path: str, metadata: Mapping[str, Any]) -> tuple[str, ...]:
    """Refuse a checkpoint whose weights the planned network could not take; return what is worth saying of others.

    The optimiser starts from zero and iterations are counted from zero, as when cloning at AWS.

    Args:
        plan: What is to be trained.
        path: The older run, for the letter.
        metadata: What its checkpoint says of itself.

    Raises:
        RunFolderError: A car of another shape; the letter says what may not change.
    """
    mine = as_dictionary(plan.settings)
    theirs = as_dictionary(from_dictionary(plan.settings, metadata["settings"]))  # what an older one lacks is as here
    for group in MUST_MATCH:
        for name, value in mine[group].items():
            if _plain(value) != _plain(theirs[group][name]):
                raise RunFolderError(
                    f"{path}: was trained with {group}.{name}={_plain(theirs[group][name])}, "
                    f"now it is {_plain(value)}; expected the same, for weights fit only the shape they were trained "
                    "in. "
                    f"Leave {group}.{name} as it was, or train afresh."
                )
    here, there = _actions(plan), metadata["model_metadata"]["action_space"]
    if len(here) != len(there):
        raise RunFolderError(
            f"{path}: was trained with {len(there)} actions, now there are {len(here)}; expected as many, since each "
            "output of the network is one action. Their angles and speeds may differ. Begin with that run's "
            "model_metadata.json."
        )
    return _notes_on_actions(plan, metadata)


def _notes_on_actions(plan: CarPlan, metadata: Mapping[str, Any]) -> tuple[str, ...]:
    """Say which actions mean something else than they did when the weights learned them."""
    pairs = list(zip(_actions(plan), metadata["model_metadata"]["action_space"], strict=True))
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
