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


def require_same_shape(plan: CarPlan, path: str, metadata: Mapping[str, Any]) -> None:
    """Refuse a checkpoint whose weights the planned network could not take.

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
    here, there = as_aws_dict(plan.model.metadata)["action_space"], metadata["model_metadata"]["action_space"]
    if here != there:
        raise RunFolderError(
            f"{path}: was trained with other actions ({_named(there)}) than those asked for ({_named(here)}); expected "
            "the same, since each output of the network is one action. Copy that run's model_metadata.json."
        )


def _named(space: Any) -> str:
    return "two ranges" if isinstance(space, dict) else f"a list of {len(space)}"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
