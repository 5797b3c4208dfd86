"""What must be alike where a car begins with the weights of an older run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import IMPORTED
from racecraft.settings.composition import Settings
from racecraft.settings.describe import value_text
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.settings.table import rows_of
from racecraft.worlds.deepracer.env.race import CRITIC_OBJECT_NUMBERS
from racecraft.worlds.deepracer.env.sensors import Sensors
from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict
from racecraft.worlds.deepracer.players.trained_car import sensors_of
from racecraft.worlds.deepracer.training.plan import CarPlan
from racecraft.worlds.deepracer.training.presets import PRESETS, preset_settings

MUST_MATCH = ("camera", "network")
"""Groups of settings that shape the weights."""
FREE = ("network.initialisation",)
"""Settings of these that say only how weights begin that nobody has learned yet."""
OF_CRITIC = ("network.privileged_critic", "network.separate_networks")
"""Settings of these that shape the critic alone; an imported model brings none that has learned."""
CRITIC_PARTS = ("critic", "value_head")
"""How the names of a critic's weights begin."""
CRITIC = "critic_body.trunk.0.weight"
"""First layer of a critic of its own; the last columns are those of the objects (`kernels/observations.py`)."""


def require_same_shape(plan: CarPlan, path: str, metadata: Mapping[str, Any]) -> tuple[str, ...]:
    """Refuse a checkpoint whose weights the planned network could not take; return what is worth saying of others.

    The optimiser starts from zero and iterations are counted from zero, as when cloning at AWS.

    Args:
        plan: What is to be trained.
        path: The older run, for the letter.
        metadata: What its checkpoint says of itself.

    Raises:
        RunFolderError: A car of another shape; the message says what may not change.
    """
    _require_same_sensors(plan, path, metadata["model_metadata"])
    _require_same_settings(plan, path, metadata["settings"], (*FREE, *OF_CRITIC) if IMPORTED in metadata else FREE)
    here, there = _action_space(plan), metadata["model_metadata"]["action_space"]
    if isinstance(here, dict) != isinstance(there, dict) or len(here) != len(there):
        raise RunFolderError(
            "{path}: was trained with {named}, now there is {named_2}; expected the same kind and as "
            "many, since each output of the network is one action. Their angles and speeds may differ. Begin with that "
            "run's model_metadata.json.",
            path=path,
            named=_named(there),
            named_2=_named(here),
        )
    return _notes_on_ranges(here, there) if isinstance(here, dict) else _notes_on_actions(here, there)


def _require_same_settings(plan: CarPlan, path: str, settings: Mapping[str, Any], free: Sequence[str]) -> None:
    """Refuse weights of another network or camera, but for `free` settings; the error says all that differs."""
    theirs = from_dictionary(plan.settings, settings)  # what an older one lacks is as here
    here, there = _shape(plan.settings), _shape(theirs)
    there = {name: value for name, value in there.items() if name not in free}
    differing = [name for name in there if here[name] != there[name]]
    if not differing:
        return
    text = ", ".join(f"{name}={value_text(there[name])} (here {value_text(here[name])})" for name in differing)
    raise RunFolderError(
        "{path}: was trained with {told}; expected the same, for weights fit only what they were trained in. Say "
        "{words_for}, or train afresh.",
        path=path,
        told=text,
        words_for=_words_for(plan, there),
    )


def _words_for(plan: CarPlan, shape: Mapping[str, Any]) -> str:
    """Return what makes a training of that shape: the preset that leaves the fewest to be set, and these."""
    typed = [one for one in plan.request.overrides if one.split(".")[0].strip() in MUST_MATCH]
    presets = {name: preset_settings(name, plan.model.metadata, plan.algorithm)[0] for name in PRESETS}
    given = {name: _shape(apply_overrides(settings, typed)) for name, settings in presets.items()}
    left = {name: [key for key in shape if mine[key] != shape[key]] for name, mine in given.items()}
    preset = min(left, key=lambda name: (len(left[name]), name != plan.request.preset))
    changed = () if preset == plan.request.preset else (f"--preset {preset}",)
    return " ".join((*changed, *(f"--set {key}={value_text(shape[key])}" for key in left[preset])))


def _shape(settings: Settings) -> dict[str, Any]:
    """Return the settings that a network's weights hang on, by their full names."""
    groups = ((group, getattr(settings, group)) for group in MUST_MATCH)
    every = {f"{group}.{row.name}": getattr(values, row.name) for group, values in groups for row in rows_of(values)}
    return every


def fit_critic(weights: Mapping[str, Array], mine: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Return weights whose critic is told of objects where the one here is, and what is worth saying about it.

    Only a car among others has a critic that hears what is in its way. Where a car that knew the road comes among
    others, the critic's columns for them begin at zero: it says at first what it said of the empty road. Where others
    are gone, so are their columns. The policy sees with its sensors and is the same in either.
    """
    theirs, ours = _of_critic(weights), _of_critic(mine)
    if theirs and ours and theirs != ours:  # of an imported model, see OF_CRITIC
        actor = {name: array for name, array in weights.items() if not name.startswith(CRITIC_PARTS)}
        critic = {name: array for name, array in mine.items() if name.startswith(CRITIC_PARTS)}
        return {**actor, **critic}, ()
    there, here = weights.get(CRITIC), mine.get(CRITIC)
    if there is None or here is None or len(there) != len(here):
        return dict(weights), ()
    more = here.shape[1] - there.shape[1]
    if abs(more) != CRITIC_OBJECT_NUMBERS:
        return dict(weights), ()
    if more > 0:
        fitted = np.concatenate([there, np.zeros((len(there), more), there.dtype)], axis=1)
        note = "the critic was not told of objects; what it makes of them begins at nothing"
    else:
        fitted = there[:, :more]
        note = "nothing is in the way any more; what the critic made of objects is left out"
    return {**weights, CRITIC: np.ascontiguousarray(fitted)}, (note,)


def _of_critic(weights: Mapping[str, Array]) -> set[str]:
    return {name for name in weights if name.startswith(CRITIC_PARTS[0])}


def _require_same_sensors(plan: CarPlan, path: str, metadata: Mapping[str, Any]) -> None:
    """Refuse weights that were trained on other inputs: other sensors, or a LiDAR that is summed up otherwise."""
    here, there = plan.sensors, sensors_of(metadata)
    if here == there or here.specs(1, 1) == there.specs(1, 1):
        return
    raise RunFolderError(
        "{path}: was trained with {seen_by}, now the car sees with {seen_by_2}; expected the same, since "
        "the network has one input for each. Begin with that run's model_metadata.json, or train afresh.",
        path=path,
        seen_by=_seen_by(there),
        seen_by_2=_seen_by(here),
    )


def _seen_by(sensors: Sensors) -> str:
    lidar = sensors.lidar
    if lidar is None:
        return sensors.camera
    sectors = f" of {lidar.sectors} sectors by {lidar.values} up to {lidar.clip_m:g} m" if lidar.sectors else ""
    return f"{sensors.camera} and {lidar.name}{sectors}"


def _notes_on_actions(here: list[dict[str, float]], there: list[dict[str, float]]) -> tuple[str, ...]:
    """Say which actions mean something else than they did when the weights learned them."""
    pairs = list(zip(here, there, strict=True))
    changed = [number for number, (now, then) in enumerate(pairs) if _pair(now) != _pair(then)]
    if not changed:
        return ()
    now, then = (_pair(action) for action in pairs[changed[0]])
    example = f"action {changed[0]} was {then[0]:g}° at {then[1]:g} m/s and is {now[0]:g}° at {now[1]:g} m/s"
    return (f"{len(changed)} of {len(pairs)} actions differ from those the weights were trained with: {example}",)


def _notes_on_ranges(here: dict[str, dict[str, float]], there: dict[str, dict[str, float]]) -> tuple[str, ...]:
    """Say which ranges differ: the weights answer in shares of a range."""
    return tuple(
        f"{name} ran from {there[name]['low']:g} to {there[name]['high']:g} when the weights were trained, now from "
        f"{span['low']:g} to {span['high']:g}: what they learned is stretched to it"
        for name, span in here.items()
        if span != there[name]
    )


def _action_space(plan: CarPlan) -> list[dict[str, float]] | dict[str, dict[str, float]]:
    space: list[dict[str, float]] | dict[str, dict[str, float]] = as_aws_dict(plan.model.metadata)["action_space"]
    return space


def _pair(action: dict[str, float]) -> tuple[float, float]:
    return action["steering_angle"], action["speed"]


def _named(space: Any) -> str:
    return "two ranges" if isinstance(space, dict) else f"a list of {len(space)} actions"
