"""What the files beside the rows say: track, build of the simulator, hyperparameters. Begin with `facts_of`."""

from __future__ import annotations

from typing import Any

from racecraft.worlds.deepracer.files.training_params import ParamsFileError, parse_params
from racecraft.worlds.deepracer.logs.log_rows import HEAD_BYTES, what_it_says
from racecraft.worlds.deepracer.logs.sources import Source, json_object

Facts = dict[str, Any]


def facts_of(source: Source) -> Facts:
    """Return what a file says.

    Of `world`, `build`, `hyperparameters`, `action_space` and `version` of the metadata, and `car`, the vehicle profile of
    a run, those that it names.

    Args:
        source: A file of kind ABOUT: JSON or YAML of a model, or a log whose rows stand in a trace.
    """
    name = source.name.rsplit("/", 1)[-1]
    if ".log" in name or name.endswith(".txt"):
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
        track, race = value.get("track"), (value.get("settings") or {}).get("race") or {}
        world = {"world": track["name"]} if isinstance(track, dict) and "name" in track else {}
        return world | ({"car": race["car"]} if "car" in race else {})
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
