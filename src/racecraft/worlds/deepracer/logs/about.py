"""What the files beside the rows say: track, build of the simulator, hyperparameters. Begin with `facts_of`."""

from __future__ import annotations

from typing import Any

from racecraft.worlds.deepracer.files.training_params import ParamsFileError, parse_params
from racecraft.worlds.deepracer.logs.log_rows import HEAD_BYTES, what_it_says
from racecraft.worlds.deepracer.logs.sources import Source, json_object

Facts = dict[str, Any]


def facts_of(source: Source) -> Facts:
    """Return what a file says.

    Of `world`, `build`, `hyperparameters`, `action_space` and `version` of the metadata, `car`, a run's vehicle
    profile, and `discount`, its discount factor, those that it names.

    Args:
        source: A file of kind ABOUT: JSON or YAML of a model, or a log whose rows stand in a trace.
    """
    name = source.name.rsplit("/", 1)[-1]
    if source.is_log:
        return _head_of_log(source)
    if name.endswith(".yaml"):
        return _world_of_params(source)
    value = json_object(source)
    if name == "hyperparameters.json" and value:
        return {"hyperparameters": value}
    if name == "model_metadata.json":
        version = {"version": str(value["version"])} if value.get("version") else {}
        return version | ({"action_space": value["action_space"]} if "action_space" in value else {})
    if name == "job.json":
        world, car = _named(value, "world", "track", "name"), _named(value, "car", "settings", "race", "car")
        return world | car | _named(value, "discount", "settings", str(value.get("algorithm")), "discount")
    return {}


def _head_of_log(source: Source) -> Facts:
    try:
        with source.open() as file:
            return what_it_says(file.read(HEAD_BYTES))
    except OSError:
        return {}


def _world_of_params(source: Source) -> Facts:
    try:
        world = parse_params(source.read().decode("utf-8", errors="replace"), source.name).get("WORLD_NAME")
    except (OSError, ParamsFileError):
        return {}
    return {"world": world} if world else {}


def _named(value: Any, name: str, *keys: str) -> Facts:
    """Return what lies in a JSON object below some keys, under a name; nothing where one of them is missing."""
    for key in keys:
        if not isinstance(value, dict) or key not in value:
            return {}
        value = value[key]
    return {name: value}
