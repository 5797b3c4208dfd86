"""`model_metadata.json`: what a car can do, what it sees, and by what network and algorithm it learns.

Begin with `read_model_metadata`. AWS writes degrees; here are radians, a positive angle turns left. The order of the
list is the number of the action; a written index changes nothing.

Source: facts: simapp `model_metadata.py`; limits of the DeepRacer-on-AWS model (`model.smithy`).
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import Faults, MetadataError, nearest
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import JsonDocument, Step, as_number, kind_of, read_json
from racecraft.worlds.deepracer.files.lidar_config import lidar_notes, read_lidar_config
from racecraft.worlds.deepracer.files.sensor_names import CAMERAS, LIDARS

MAX_STEERING_DEG = 30.0
MIN_SPEED_MPS, MAX_SPEED_MPS = 0.1, 4.0
"""What is sent to a car is clipped to ±30 degrees and to these speeds. Any number may be written: AWS checked no range,
and its reward functions and traces saw the number as written (facts 1.2, 9.7)."""
CONSOLE_MAX_ACTIONS = 30
MAX_ACTIONS = 1000
"""Each is an output of the network; layers and logs of far more outgrow memory."""

OTHER_SENSORS = {
    **dict.fromkeys(
        ("front_camera", "front_facing", "front-facing_camera", "front-facing camera", "camera"), "FRONT_FACING_CAMERA"
    ),
    **dict.fromkeys(("stereo_camera", "stereo camera", "stereo"), "STEREO_CAMERAS"),
}
"""Other names of sensors that can mean only one."""
NETWORKS = (
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "DEEP_CONVOLUTIONAL_NETWORK",
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP",
)
ALGORITHMS = ("clipped_ppo", "sac")
KEYS = (
    "action_space",
    "sensor",
    "neural_network",
    "training_algorithm",
    "action_space_type",
    "version",
    "lidar_config",
)

_KIND = "a JSON object with the keys action_space, sensor, neural_network, version"


@dataclass(frozen=True)
class CarAction:
    """One of the choices of a car with a discrete action space."""

    steering_rad: float
    """Commanded angle of the front wheels, positive left."""
    speed_mps: float
    """Commanded speed."""

    @property
    def label(self) -> str:
        """The action in a racer's words.

        >>> CarAction(math.radians(-15), 1.0).label
        'right 15°, 1 m/s'
        """
        degrees = _degrees(self.steering_rad)
        side = "straight" if degrees == 0 else f"{'left' if degrees > 0 else 'right'} {abs(degrees):g}°"
        return f"{side}, {self.speed_mps:g} m/s"


@dataclass(frozen=True)
class ActionRanges:
    """The two ranges of a car with a continuous action space."""

    steering_low_rad: float
    steering_high_rad: float
    speed_low_mps: float
    speed_high_mps: float


@dataclass(frozen=True)
class ModelMetadata:
    """A car, as its `model_metadata.json` describes it."""

    action_space: tuple[CarAction, ...] | ActionRanges
    """The actions by number, or the ranges of a continuous action space."""
    sensors: tuple[str, ...] = ("FRONT_FACING_CAMERA",)
    """One of `CAMERAS`, and at most one of `LIDARS`."""
    neural_network: str = NETWORKS[0]
    training_algorithm: str = "clipped_ppo"
    version: str | None = None
    """Version of the car's physics, "1" to "6"; None where the file names none."""
    lidar_config: Mapping[str, float] | None = None
    """num_sectors, num_values_per_sector, clipping_dist (m); kept also where no LiDAR is on board."""
    unknown: Mapping[str, Any] = field(default_factory=dict)
    """Keys we do not know, kept as they were."""
    notes: tuple[str, ...] = field(default=(), compare=False)
    """What is worth telling the user, a clause each."""

    @property
    def action_space_type(self) -> str:
        """Either "discrete" or "continuous"."""
        return "continuous" if isinstance(self.action_space, ActionRanges) else "discrete"

    @property
    def actions(self) -> tuple[CarAction, ...]:
        """The actions by number; empty for a continuous action space."""
        return () if isinstance(self.action_space, ActionRanges) else self.action_space

    @property
    def car(self) -> str:
        """The vehicle profile that goes with the version: "v4", "v5-classic" or "v6"."""
        return car_for_version(self.version)


RACING_SPEEDS_MPS: dict[str, tuple[float, ...]] = {"v4": (1.0, 2.0, 3.0, 4.0), "v5-classic": (1.0, 2.2, 4.0)}
"""By vehicle profile: the speeds of a car that races, m/s. The slowest takes the tightest corners at full lock, the
fastest is the fastest command in the logs of that car."""
TODAYS_SPEEDS_MPS = (1.5, 2.5)
"""Those of every other profile."""
RACING_VERSIONS = {"v4": "4", "v5-classic": "5"}
"""The metadata version that goes with a profile; "6" with every other."""


def racing_model_metadata(car: str = "v6") -> ModelMetadata:
    """Return the car that races: seven angles at a few speeds, numbered from right to left, slow before fast.

    Args:
        car: Vehicle profile.

    >>> len(racing_model_metadata().actions), racing_model_metadata().actions[0].label
    (14, 'right 30°, 1.5 m/s')
    >>> racing_model_metadata("v5-classic").actions[2].label, racing_model_metadata("v5-classic").version
    ('right 30°, 4 m/s', '5')
    """
    angles = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)
    speeds = RACING_SPEEDS_MPS.get(car, TODAYS_SPEEDS_MPS)
    actions = tuple(CarAction(math.radians(angle), speed) for angle in angles for speed in speeds)
    return ModelMetadata(actions, version=RACING_VERSIONS.get(car, "6"))


def default_model_metadata() -> ModelMetadata:
    """Return the console's kind of default car, driven as today's cars drive; it crawls.

    Five angles at 0.5 and 1.0 m/s, numbered from right to left, slow before fast; front camera, shallow network.

    >>> [action.label for action in default_model_metadata().actions][:3]
    ['right 30°, 0.5 m/s', 'right 30°, 1 m/s', 'right 15°, 0.5 m/s']
    """
    actions = tuple(
        CarAction(math.radians(angle), speed) for angle in (-30.0, -15.0, 0.0, 15.0, 30.0) for speed in (0.5, 1.0)
    )
    return ModelMetadata(actions, version="6")


def car_for_version(version: str | None) -> str:
    """Return the vehicle profile for a version: 1 to 4 is "v4", 5 is "v5-classic", 6 or none is "v6".

    Version 5 is what the console wrote from July 2022 to its end, and there its cars drove as "v5-classic". DeepRacer
    on AWS and DeepRacer for Cloud 6 drive any version from 5 on as "v6": the file does not say where it was driven.

    >>> car_for_version("3"), car_for_version("5"), car_for_version(None)
    ('v4', 'v5-classic', 'v6')
    """
    if version is None or float(version) >= 6:
        return "v6"
    return "v5-classic" if float(version) >= 5 else "v4"


def read_model_metadata(path: str | Path) -> ModelMetadata:
    """Read a car.

    Numbers may be written as text, keys we do not know are kept and named in `notes`.

    Raises:
        MetadataError: The file is missing or no JSON, or a value is of the wrong kind or out of range; the letter
            names file, line and key.
        SeveralFaultsError: Several values are.
    """
    document = read_json(path, MetadataError, _KIND)
    if not isinstance(document.value, dict):
        raise MetadataError(path, Message("the file holds {kind_of}", kind_of=kind_of(document.value)), _KIND, line=1)
    notes = list(document.notes)
    readers: Mapping[str, Callable[[], Any]] = {
        "action_space": lambda: _read_action_space(document, notes),
        "sensors": lambda: _read_sensors(document, notes),
        "neural_network": lambda: _read_word(document, "neural_network", NETWORKS, NETWORKS[0], notes),
        "training_algorithm": lambda: _read_word(document, "training_algorithm", ALGORITHMS, ALGORITHMS[0], notes),
        "version": lambda: _read_version(document),
        "lidar_config": lambda: read_lidar_config(document),
    }
    parts, faults = {}, Faults()
    for name, read in readers.items():
        with faults.collect():
            parts[name] = read()
    faults.raise_found()
    unknown = {key: value for key, value in document.value.items() if key not in KEYS}
    metadata = ModelMetadata(**parts, unknown=unknown)
    _check_type(document, metadata)
    notes += lidar_notes(metadata.sensors, metadata.lidar_config)
    for key in metadata.unknown:
        hint = nearest(key, KEYS)
        near = f". {hint}" if hint.startswith("Did you mean") else ""
        notes.append(f"unknown key '{key}' is kept and does nothing{near}")
    return replace(metadata, notes=tuple(notes))


def write_model_metadata(metadata: ModelMetadata, path: str | Path) -> None:
    """Write a car, always with every key that readers look for; a car without a version is written as version 5.

    Raises:
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, json.dumps(as_aws_dict(metadata), indent=2) + "\n")


def as_aws_dict(metadata: ModelMetadata) -> dict[str, Any]:
    """Return the car as the dictionary that AWS writes: degrees, m/s."""
    space = metadata.action_space
    if isinstance(space, ActionRanges):
        written: Any = {
            "steering_angle": {"low": _degrees(space.steering_low_rad), "high": _degrees(space.steering_high_rad)},
            "speed": {"low": space.speed_low_mps, "high": space.speed_high_mps},
        }
    else:
        written = [
            {"steering_angle": _degrees(action.steering_rad), "speed": action.speed_mps, "index": number}
            for number, action in enumerate(space)
        ]
    lidar = {} if metadata.lidar_config is None else {"lidar_config": dict(metadata.lidar_config)}
    return {
        "action_space": written,
        "sensor": list(metadata.sensors),
        "neural_network": metadata.neural_network,
        "training_algorithm": metadata.training_algorithm,
        "action_space_type": metadata.action_space_type,
        "version": metadata.version or "5",
        **lidar,
        **metadata.unknown,
    }


def action_space_from_aws(written: Any) -> tuple[CarAction, ...] | ActionRanges:
    """Return the action space of a dictionary that `as_aws_dict` made; a racer's own file is `read_model_metadata`'s.

    >>> action_space_from_aws([{"steering_angle": 0, "speed": 1}])
    (CarAction(steering_rad=0.0, speed_mps=1.0),)
    """
    if isinstance(written, Mapping):
        angle, speed = written["steering_angle"], written["speed"]
        return ActionRanges(
            math.radians(angle["low"]), math.radians(angle["high"]), float(speed["low"]), float(speed["high"])
        )
    return tuple(CarAction(math.radians(entry["steering_angle"]), float(entry["speed"])) for entry in written)


def _read_action_space(document: JsonDocument, notes: list[str]) -> tuple[CarAction, ...] | ActionRanges:
    if "action_space" not in document.value:
        expected = "a list of actions with steering_angle and speed"
        raise MetadataError(document.path, "the key is missing", expected, key="action_space")
    space = document.value["action_space"]
    if isinstance(space, dict):
        return _read_ranges(document, notes)
    if not isinstance(space, list):
        raise document.error_at("action_space", found=kind_of(space), expected="a list of actions, or two ranges")
    if len(space) < 2:
        raise document.error_at(
            "action_space", found=Message("{count} action(s)", count=len(space)), expected="2 actions or more"
        )
    if len(space) > CONSOLE_MAX_ACTIONS:
        notes.append(f"{len(space)} actions train here; AWS consoles take at most {CONSOLE_MAX_ACTIONS}")
    if len(space) > MAX_ACTIONS:
        raise document.error_at(
            "action_space",
            found=Message("{count} actions", count=len(space)),
            expected=Message("2 to {max_actions:,}", max_actions=MAX_ACTIONS),
        )
    actions, faults = [], Faults()
    for number in range(len(space)):
        with faults.collect():
            actions.append(_read_action(document, number))
    faults.raise_found()
    _note_actions(space, tuple(actions), notes)
    return tuple(actions)


def _read_action(document: JsonDocument, number: int) -> CarAction:
    entry = document.value["action_space"][number]
    if not isinstance(entry, dict):
        raise document.error_at(
            "action_space", number, found=kind_of(entry), expected="an object with steering_angle and speed"
        )
    for key in ("steering_angle", "speed"):
        if key not in entry:
            expected = "steering_angle in degrees and speed in m/s"
            raise document.error_at(
                "action_space", number, found=Message("there is no '{key}'", key=key), expected=expected
            )
    steering = _read_number(document, "in degrees", "action_space", number, "steering_angle")
    speed = _read_number(document, "in m/s", "action_space", number, "speed")
    return CarAction(math.radians(steering), speed)


def _note_actions(entries: list[Any], actions: tuple[CarAction, ...], notes: list[str]) -> None:
    beyond = [action for action in actions if not _is_full_range(action.steering_rad, action.speed_mps)]
    if beyond:
        which = "; ".join(dict.fromkeys(action.label for action in beyond[:3])) + ("; …" if len(beyond) > 3 else "")
        notes.append(_clipping(f"{len(beyond)} of {len(actions)} actions ({which})"))
    indices = [entry["index"] for entry in entries if "index" in entry]
    if indices and [as_number(index) for index in indices] != list(range(len(actions))):
        notes.append("the written index differs from the order of the list; the order counts, as at AWS")
    if len(set(actions)) < len(actions):
        notes.append("the same action stands in the list more than once")


def _read_ranges(document: JsonDocument, notes: list[str]) -> ActionRanges:
    ends: dict[str, tuple[float, float]] = {}
    for key, unit in (("steering_angle", "in degrees"), ("speed", "in m/s")):
        entry = document.value["action_space"].get(key)
        if not isinstance(entry, dict) or "low" not in entry or "high" not in entry:
            found = Message("there is no '{key}'", key=key) if entry is None else Message("{entry!r}", entry=entry)
            raise document.error_at("action_space", key, found=found, expected='{"low": number, "high": number}')
        first = _read_number(document, unit, "action_space", key, "low")
        last = _read_number(document, unit, "action_space", key, "high")
        if not first < last:
            found = Message("low is {first:g} and high is {last:g}", first=first, last=last)
            raise document.error_at("action_space", key, found=found, expected="a low that is below high")
        ends[key] = (first, last)
    right, left = ends["steering_angle"]
    space = ActionRanges(math.radians(right), math.radians(left), *ends["speed"])
    if not (
        _is_full_range(space.steering_low_rad, space.speed_low_mps)
        and _is_full_range(space.steering_high_rad, space.speed_high_mps)
    ):
        reach = f"{right:g} to {left:g}° and {space.speed_low_mps:g} to {space.speed_high_mps:g} m/s"
        notes.append(_clipping(f"actions from {reach}"))
    return space


def _is_full_range(steering_rad: float, speed_mps: float) -> bool:
    return abs(_degrees(steering_rad)) <= MAX_STEERING_DEG and MIN_SPEED_MPS <= speed_mps <= MAX_SPEED_MPS


def _clipping(what: str) -> str:
    return (
        f"{what} reach beyond what is sent to a car and are clipped there to ±{MAX_STEERING_DEG:g}° and "
        f"{MIN_SPEED_MPS:g} to {MAX_SPEED_MPS:g} m/s: the reward function and the traces see them so, with --fidelity "
        "aws as written"
    )


def _read_sensors(document: JsonDocument, notes: list[str]) -> tuple[str, ...]:
    if "sensor" not in document.value:
        only = "FRONT_FACING_CAMERA" if document.value.get("version") else "observation"
        notes.append(f"there is no sensor; '{only}', the front camera, is taken")
        return (only,)
    written = document.value["sensor"]
    if isinstance(written, str):
        notes.append("sensor is a word; AWS expects a list with that word")
        written = [written]
    if not isinstance(written, list) or not all(isinstance(name, str) for name in written):
        raise document.error_at("sensor", found=repr(written), expected="a list of names of sensors")
    known = {name.casefold(): name for name in CAMERAS + LIDARS}
    for name in written:
        meant = OTHER_SENSORS.get(name.strip().casefold())
        if meant is not None:
            notes.append(f"sensor '{name}' is read as '{meant}'")
            known[name.strip().casefold()] = meant
        elif name.strip().casefold() not in known:
            hint = nearest(name, CAMERAS + LIDARS)
            raise document.error_at(
                "sensor", found=Message("'{name}'", name=name), expected="the name of a sensor", hint=hint
            )
    sensors = tuple(known[name.strip().casefold()] for name in written)
    cameras, lidars = (sum(name in kind for name in sensors) for kind in (CAMERAS, LIDARS))
    if cameras != 1 or lidars > 1:
        found = Message(
            "{cameras} camera(s) and {lidars} LiDAR(s): {sensors}",
            cameras=cameras,
            lidars=lidars,
            sensors=", ".join(sensors) or "nothing",
        )
        raise document.error_at("sensor", found=found, expected="exactly one camera and at most one LiDAR")
    return sensors


def _read_word(document: JsonDocument, key: str, known: tuple[str, ...], default: str, notes: list[str]) -> str:
    if key not in document.value:
        if key == "neural_network":
            notes.append(f"there is no {key}; {default} is taken")
        return default
    written = document.value[key]
    if isinstance(written, str):
        folded = {"ppo": "clipped_ppo"}.get(written.strip().casefold(), written.strip().casefold())
        for name in known:
            if name.casefold() == folded:
                return name
    raise document.error_at(key, found=repr(written), expected=" or ".join(known), hint=nearest(str(written), known))


def _read_version(document: JsonDocument) -> str | None:
    written = document.value.get("version")
    if written is None or written == "":
        return None
    number = as_number(written)
    if number is None or not 1 <= number < 7:
        raise document.error_at("version", found=repr(written), expected='"1" to "6"')
    return f"{number:g}"


def _check_type(document: JsonDocument, metadata: ModelMetadata) -> None:
    written = document.value.get("action_space_type")
    if written is not None and str(written).strip().casefold() != metadata.action_space_type:
        known = ("discrete", "continuous")
        if str(written).strip().casefold() not in known:
            raise document.error_at("action_space_type", found=repr(written), expected="discrete or continuous")
        shape = "a list of actions" if metadata.action_space_type == "discrete" else "two ranges"
        raise document.error_at(
            "action_space_type",
            found=Message("{written!r}, while action_space is {shape}", written=written, shape=shape),
            expected=Message(
                "'{action_space_type}' with such an action_space", action_space_type=metadata.action_space_type
            ),
        )
    if metadata.training_algorithm == "sac" and metadata.action_space_type == "discrete":
        raise document.error_at(
            "training_algorithm", found="'sac' with a list of actions", expected="continuous ranges"
        )


def _read_number(document: JsonDocument, unit: str, *steps: Step) -> float:
    value = document.value
    for step in steps:
        value = value[step]
    number = as_number(value)
    if number is None or not abs(number) <= sys.float_info.max:
        raise document.error_at(*steps, found=repr(value)[:40], expected=Message("a number, {unit}", unit=unit))
    return float(number)


def _degrees(angle_rad: float) -> float:
    """Return degrees as they were written before they became radians (-30, not -29.999999999999996)."""
    return round(math.degrees(angle_rad), 10) + 0.0
