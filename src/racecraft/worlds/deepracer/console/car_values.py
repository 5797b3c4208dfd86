"""From the values of the form to the racer's three files and a command. Begin with `files` and `words`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from racecraft.contract.errors import RewardFileError, SettingError, UserInputError
from racecraft.contract.message import Message
from racecraft.formats.run_folder import HYPERPARAMETERS, MODEL_METADATA, REWARD_FUNCTION, RunFolder
from racecraft.worlds.deepracer.console.car_form import as_json, defaults
from racecraft.worlds.deepracer.files.hyperparameters import read_hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import NETWORKS

HYPER = ("lr", "discount_factor", "beta_entropy", "num_epochs", "batch_size", "loss_type")
MAX_STEERING_DEG, MIN_SPEED_MPS, MAX_SPEED_MPS = 30.0, 0.1, 4.0
ASKED_METADATA = ("action_space", "sensor", "training_algorithm", "action_space_type")
"""Keys of the metadata that the form asks for."""
UNASKED_METADATA, UNASKED_HYPER = "metadata", "hyperparameters"
"""Values of a clone that the form does not ask for and that its files keep: version and network of the car, …"""
_RANGES = re.compile(r"(\S+) to (\S+)\s*[,;]\s*(\S+) to (\S+)")
"""Lowest and highest angle, lowest and highest speed."""


def files(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the racer's files, text by name.

    Raises:
        SettingError: An action cannot be used.
        RewardFileError: The reward function is not Python.
    """
    full = defaults() | dict(values)
    reward = str(full["reward"]).replace("\r\n", "\n")
    try:
        compile(reward, REWARD_FUNCTION, "exec")
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        raise RewardFileError(
            REWARD_FUNCTION,
            Message("{getattr}", getattr=getattr(error, "msg", error)),
            "Python that can be read",
            line=line,
        ) from None
    changed = {name: full[name] for name in HYPER if full[name] != defaults()[name]}
    changed |= full.get(UNASKED_HYPER, {})
    texts = {REWARD_FUNCTION: reward, MODEL_METADATA: as_json(_metadata(full))}
    return texts | {HYPERPARAMETERS: as_json(changed)}  # also where none is changed: a model that goes on has old ones


def words(values: Mapping[str, Any]) -> list[str]:
    """Return what is typed behind `racecraft` in the model's folder."""
    full = defaults() | dict(values)
    stops = [*(["--stop=laps"] if full["stop_laps"] else []), f"--stop=minutes={full['minutes']:g}"]
    return [
        "train",
        ".",
        f"--track={full['track']}",
        *([] if full["algorithm"] == "ppo" else [f"--algorithm={full['algorithm']}"]),
        *(f"--set={one}" for one in _settings(full)),
        *stops,
        "--no-pictures",
        *([f"--from={full['from']}"] if full.get("from") else []),
    ]


def _settings(full: Mapping[str, Any]) -> list[str]:
    overrides = ["race.reverse=true"] if full["reverse"] else []
    if full["race"] == "TIME_TRIAL":
        return overrides
    group = "boxes" if full["race"] == "OBJECT_AVOIDANCE" else "bots"
    overrides += [
        f"race.type={full['race']}",
        f"{group}.number={full['objects']}",
        f"{group}.random={str(bool(full['random_places'])).lower()}",
    ]
    return [*overrides, f"bots.speed={full['bot_speed']:g}"] if group == "bots" else overrides


def _metadata(full: Mapping[str, Any]) -> dict[str, Any]:
    sensors = [name for name in (full["camera"], full["lidar"]) if name]
    if not sensors:
        raise SettingError("Sensors: found none; expected a camera or a LiDAR.")
    actions = read_actions(str(full["actions"]))
    return {
        "neural_network": NETWORKS[0],
        "version": "6",
        **full.get(UNASKED_METADATA, {}),
        "action_space": actions,
        "sensor": sensors,
        "training_algorithm": "sac" if full["algorithm"] == "sac" else "clipped_ppo",
        "action_space_type": "discrete" if isinstance(actions, list) else "continuous",
    }


def read_actions(text: str) -> list[dict[str, float]] | dict[str, dict[str, float]]:
    """Return the actions of a text with one a line, or the ranges of its only line, as AWS's file has them.

    Raises:
        SettingError: A line cannot be used; the message names it.

    >>> read_actions("-30, 1.5; 0, 3".replace("; ", chr(10)))[1]
    {'steering_angle': 0.0, 'speed': 3.0, 'index': 1}
    >>> read_actions("-30 to 30, 1 to 2.5")["speed"]
    {'low': 1.0, 'high': 2.5}
    """
    if match := _RANGES.fullmatch(text.strip()):
        ends = [_action(*pair, 1, text.strip()) for pair in ((match[1], match[3]), (match[2], match[4]))]
        if any(ends[0][name] >= ends[1][name] for name in ends[0]):
            raise SettingError("Actions: found {line!r}; expected the lower end of each range first.", line=text[:40])
        return {name: {"low": ends[0][name], "high": ends[1][name]} for name in ends[0]}
    found: list[dict[str, float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        try:
            steering, speed = line.replace(";", ",").split(",")
        except ValueError:
            raise _unreadable(number, line) from None
        found.append({**_action(steering, speed, number, line), "index": len(found)})
    if len(found) < 2:
        raise SettingError(
            "Actions: found {count}; expected at least two lines, each degrees, m/s, or ranges, as -30 to 30, 1 to 3.",
            count=len(found),
        )
    return found


def _action(steering: str, speed: str, number: int, line: str) -> dict[str, float]:
    """Return one action, degrees and m/s, of a line with this number."""
    try:
        action = {"steering_angle": float(steering), "speed": float(speed)}
    except ValueError:
        raise _unreadable(number, line) from None
    if not (abs(action["steering_angle"]) <= MAX_STEERING_DEG and MIN_SPEED_MPS <= action["speed"] <= MAX_SPEED_MPS):
        raise SettingError(
            "Actions, line {number}: found {line!r}; expected -30 to 30 degrees and 0.1 to 4 m/s.",
            number=number,
            line=line.strip()[:40],
        )
    return action


def _unreadable(number: int, line: str) -> SettingError:
    return SettingError(
        "Actions, line {number}: found {line!r}; expected degrees, m/s, as -30, 1.5.", number=number, line=line[:40]
    )


BODY = ("actions", "camera", "lidar", "algorithm")
"""What the weights of a network depend on."""


def values_of(run: RunFolder) -> dict[str, Any]:
    """Return the values of the form that a run was made with, as far as it tells.

    Raises:
        RunFolderError: The run cannot be read.
        HyperparameterError: Its hyperparameters cannot.
    """
    job = run.read_job()
    settings, metadata = job.get("settings") or {}, job.get("model_metadata") or {}
    race: Mapping[str, Any] = settings.get("race") or {}
    sensors = list(metadata.get("sensor") or ())
    found: dict[str, Any] = {
        "weights": True,
        "track": (job.get("track") or {}).get("name"),
        "reverse": bool(race.get("reverse", False)),
        "race": race.get("type"),
        "algorithm": job.get("algorithm"),
        "camera": next((name for name in sensors if "CAMERA" in name), ""),
        "lidar": next((name for name in sensors if "LIDAR" in name), ""),
    }
    for group in ("boxes", "bots"):
        if group in settings:
            found |= {"objects": settings[group]["number"], "random_places": settings[group]["random"]}
    if "bots" in settings:
        found["bot_speed"] = settings["bots"]["speed"]
    if run.hyperparameters.is_file():
        given = read_hyperparameters(run.hyperparameters)
        found |= {name: getattr(given, name) for name in HYPER if name in given.given}
        found[UNASKED_HYPER] = {name: getattr(given, name) for name in given.given if name not in HYPER}
    if metadata:
        found[UNASKED_METADATA] = {name: value for name, value in metadata.items() if name not in ASKED_METADATA}
        found["actions"] = _actions_text(metadata.get("action_space"))
    if run.reward_function.is_file():
        found["reward"] = run.reward_function.read_text(encoding="utf-8", errors="replace")
    return {name: value for name, value in (defaults() | found).items() if value is not None}


def _actions_text(space: Any) -> str | None:
    """Return an action space of AWS's file as `read_actions` takes it; None: there is none."""
    if isinstance(space, Mapping):
        angle, speed = space["steering_angle"], space["speed"]
        return f"{angle['low']:g} to {angle['high']:g}, {speed['low']:g} to {speed['high']:g}"
    return "\n".join(f"{row['steering_angle']:g}, {row['speed']:g}" for row in space) if space else None


def require_same_body(values: Mapping[str, Any], base: Mapping[str, Any]) -> None:
    """Refuse a clone whose weights would not fit it.

    Raises:
        SettingError: The actions, a sensor or the algorithm differ.
    """
    differing = [name for name in BODY if str(values.get(name)).strip() != str(base.get(name)).strip()]
    if differing:
        raise SettingError(
            "Clone: found other {differing} than the weights were learned with; expected the same. "
            "Switch off 'Begin with its weights', or put them back.",
            differing=" and ".join(differing),
        )


def summary(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what is chosen, in a few words."""
    text = str(values["actions"])
    count = len([line for line in text.splitlines() if line.strip()])
    sooner = ", or when it laps" if values["stop_laps"] else ""
    return [
        ("Track", str(values["track"])),
        ("Race", str(values["race"]).replace("_", " ").lower()),
        ("Algorithm", str(values["algorithm"]).upper()),
        ("Car", "ranges of actions" if _RANGES.fullmatch(text.strip()) else f"{count} actions"),
        ("Ends after", f"{values['minutes']:g} min{sooner}"),
    ]


def remarks(values: Mapping[str, Any]) -> list[str]:
    """Return why the reward function or the actions cannot be used; none: they can."""
    try:
        files(values)
    except UserInputError as error:
        return [str(error)]
    return []
