"""What differs from one episode to the next, so that a policy does not learn one simulator by heart.

Begin with `VariationConfig`: a level, and the range of every disturbance. A range is the most by which something may
stray: each episode of each car draws its own amounts, evenly within the ranges, and keeps them to its end (`DRAWN` is
what is written down of them). A range of 0 changes nothing.

The original varies two things, lamps and the colours of objects (facts: deepracer.md 7); that is the level `aws`. What
breaks a policy on a real car, where the camera sits and how late and how crooked the car answers, it never touched;
those are ours, in the levels `light` and `strong`. The level `perturbed` is for racing in the simulator
(benchmarks/racing.md). `randomisation.py` draws, `kernels/variation.py` has the compiled passes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from racecraft.contract.errors import SettingError, nearest
from racecraft.settings.table import check_group, setting
from racecraft.worlds.deepracer.env.scene import MATERIALS
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

LEVELS = {
    "off": "every episode is like the other",
    "perturbed": "commands stray, so that a car learns to leave itself room",
    "aws": "lamps and colours of objects, as the original's domain randomisation",
    "light": "what two cars of one batch differ by, in one room",
    "strong": "another car, badly built, in another room",
}
"""Every level, with what it stands for."""
MAX_LATENCY_TICKS = 9


def _range(doc: str, unit: str, high: float) -> Any:
    """Return the setting of a range; None: as the level has it."""
    return setting(None, doc, unit=unit, low=0.0, high=high)


@dataclass(frozen=True)
class VariationConfig:
    """What differs from episode to episode; a range that is none is as its level has it."""

    level: str = setting("off", "How much differs where a range says nothing.", choices=tuple(LEVELS))
    in_evaluations: bool = setting(True, "Whether evaluations of a training draw from the same ranges.")
    lamps: bool | None = setting(None, "Sun and lamp shine in any colour, as the original's.")
    object_colours: bool | None = setting(None, "Every box and bot has any colour, as the original's.")
    palette: float | None = _range("Red, green and blue of every material, each more or less by up to.", "share", 1.0)
    gain: float | None = _range("The whole frame brighter or darker by up to.", "share", 0.9)
    gradient: float | None = _range("One edge of the frame brighter than its middle, the other darker.", "share", 1.0)
    grain: float | None = _range("The field more grained by up to; with camera.grass on top of its own.", "level", 60.0)
    glare: float | None = _range("A glow that stands in the world as a far lamp, brighter by up to.", "level", 255.0)
    glare_width: float = setting(0.15, "Spread of that glow.", unit="rad", low=0.01, high=1.0)
    noise: float | None = _range("Every pixel strays by itself, standard deviation of up to.", "level", 60.0)
    blur: float | None = _range("Spread of an unsharp lens of up to, share of the frame's width.", "share", 0.05)
    camera_height: float | None = _range("The camera higher or lower by up to.", "m", 0.06)
    camera_pitch: float | None = _range("It looks more up or down by up to.", "rad", 0.2)
    camera_roll: float | None = _range("It leans to a side by up to.", "rad", 0.3)
    camera_view: float | None = _range("Its horizontal angle of view is wider or narrower by up to.", "rad", 0.4)
    latency: float | None = _range(
        "Commands act later by up to, in whole ticks of 1/15 s.", "s", MAX_LATENCY_TICKS / TICKS_PER_SECOND
    )
    dropped_frames: float | None = _range("Frames that fail and show the one before again, up to.", "share", 0.9)
    steering_gain: float | None = _range("Wheels turn further or less far than told by up to.", "share", 0.9)
    steering_offset: float | None = _range("Straight on is left or right by up to.", "rad", 0.3)
    steering_lag: float | None = _range("Wheels come round more slowly, their time constant longer by up to.", "s", 1.0)
    speed_gain: float | None = _range("The car drives faster or slower than told by up to.", "share", 0.9)
    slip: float | None = _range(
        "Tyres hold less: one over the sideways acceleration that they hold grows by up to.", "s²/m", 2.0
    )
    steering_noise: float | None = _range("Commands to the wheels stray, standard deviation of up to.", "rad", 0.3)
    speed_noise: float | None = _range("Commands of speed stray, standard deviation of up to.", "share", 0.9)

    def __post_init__(self) -> None:
        check_group(self)
        if self.latency and round(self.latency * TICKS_PER_SECOND) == 0:
            raise SettingError(
                "variation.latency is {latency:g} s, less than half a tick; expected 0, or at least "
                "{ticks_per_second:.3f} s: commands are given 15 times a second.",
                latency=self.latency,
                ticks_per_second=1 / TICKS_PER_SECOND,
            )

    @property
    def amounts(self) -> dict[str, float]:
        """Return every range as it holds, by name; switches are 0 or 1."""
        level = AMOUNTS[self.level]
        given = {name: getattr(self, name) for name in RANGES}
        return {name: float(level.get(name, 0.0) if value is None else value) for name, value in given.items()}

    @property
    def is_on(self) -> bool:
        """Whether anything differs at all."""
        return any(self.amounts.values())


RANGES = tuple(
    field.name
    for field in dataclasses.fields(VariationConfig)
    if field.name not in ("level", "in_evaluations", "glare_width")
)
"""The settings that are 0, False or none where nothing differs."""

AMOUNTS: Mapping[str, Mapping[str, float]] = {
    "off": {},
    "perturbed": {"steering_gain": 0.05, "steering_noise": 0.1, "speed_noise": 0.1},
    "aws": {"lamps": 1.0, "object_colours": 1.0},
    "light": {
        "palette": 0.08, "gain": 0.12, "gradient": 0.08, "grain": 4.0, "glare": 40.0, "noise": 3.0, "blur": 0.004,
        "camera_height": 0.004, "camera_pitch": 0.018, "camera_roll": 0.009, "camera_view": 0.02,
        "latency": 1 / 15, "dropped_frames": 0.02, "steering_gain": 0.05, "steering_offset": 0.01,
        "steering_lag": 0.02, "speed_gain": 0.05, "slip": 0.02, "steering_noise": 0.01, "speed_noise": 0.02,
    },
    "strong": {
        "object_colours": 1.0, "palette": 0.25, "gain": 0.4, "gradient": 0.3, "grain": 12.0, "glare": 150.0,
        "noise": 12.0, "blur": 0.015, "camera_height": 0.02, "camera_pitch": 0.07, "camera_roll": 0.05,
        "camera_view": 0.09, "latency": 0.2, "dropped_frames": 0.2, "steering_gain": 0.2, "steering_offset": 0.05,
        "steering_lag": 0.1, "speed_gain": 0.2, "slip": 0.2, "steering_noise": 0.06, "speed_noise": 0.1,
    },
}  # fmt: skip
"""What a level's ranges are; one that is not named is 0. Our choice: a degree, a shade and a tick for `light`, four
degrees, another room and three ticks for `strong`. `light` keeps object colours, which a race may tell boxes by.
`perturbed` leaves a car on average as fast as it is told, so that laps of its training compare with others."""


class Disturbance(NamedTuple):
    """What the robustness report tries by itself."""

    settings: tuple[str, ...]
    """Ranges of `VariationConfig` that belong together."""
    is_seen: bool
    """It shows in the frame, rather than in how the car drives."""


DISTURBANCES: Mapping[str, Disturbance] = {
    "lamps": Disturbance(("lamps",), True),
    "object-colours": Disturbance(("object_colours",), True),
    "palette": Disturbance(("palette",), True),
    "light": Disturbance(("gain", "gradient"), True),
    "texture": Disturbance(("grain",), True),
    "glare": Disturbance(("glare",), True),
    "noise": Disturbance(("noise",), True),
    "blur": Disturbance(("blur",), True),
    "height": Disturbance(("camera_height",), True),
    "pitch": Disturbance(("camera_pitch",), True),
    "roll": Disturbance(("camera_roll",), True),
    "view": Disturbance(("camera_view",), True),
    "dropped-frames": Disturbance(("dropped_frames",), True),
    "latency": Disturbance(("latency",), False),
    "steering-gain": Disturbance(("steering_gain",), False),
    "steering-offset": Disturbance(("steering_offset",), False),
    "steering-lag": Disturbance(("steering_lag",), False),
    "speed-gain": Disturbance(("speed_gain",), False),
    "grip": Disturbance(("slip",), False),
    "action-noise": Disturbance(("steering_noise", "speed_noise"), False),
}
"""Every disturbance, by the name that a command takes."""


class RandomisedParameter(NamedTuple):
    """One number that is drawn for an episode and written down with it."""

    name: str
    unit: str
    doc: str


DRAWN = (
    RandomisedParameter("gain", "", "The frame is brighter by this factor."),
    RandomisedParameter("gradient_x", "", "Share by which the right edge is brighter than the middle."),
    RandomisedParameter("gradient_y", "", "Share by which the lower edge is."),
    RandomisedParameter("grain", "level", "Spread of the field's grain."),
    RandomisedParameter("glare", "level", "Brightness of the glow in its middle."),
    RandomisedParameter("glare_azimuth", "rad", "Where it stands, counter-clockwise from east."),
    RandomisedParameter("glare_elevation", "rad", "How high, above the horizon."),
    RandomisedParameter("noise", "level", "Standard deviation of every pixel."),
    RandomisedParameter("blur", "width", "Spread of the lens, share of the frame's width."),
    RandomisedParameter("camera_height", "m", "How much higher the camera sits."),
    RandomisedParameter("camera_pitch", "rad", "How much further down it looks."),
    RandomisedParameter("camera_roll", "rad", "How far it leans to the right."),
    RandomisedParameter("camera_view", "rad", "How much wider its view is."),
    RandomisedParameter("latency", "s", "How much later commands act."),
    RandomisedParameter("dropped_frames", "", "Share of the frames that fail."),
    RandomisedParameter("steering_gain", "", "The wheels turn by this factor."),
    RandomisedParameter("steering_offset", "rad", "What they turn besides, left positive."),
    RandomisedParameter("steering_lag", "s", "How much longer the time constant of the steering is."),
    RandomisedParameter("speed_gain", "", "The car drives faster by this factor."),
    RandomisedParameter("slip", "s²/m", "What is added to one over the sideways acceleration that the tyres hold."),
    RandomisedParameter("steering_noise", "rad", "Standard deviation of every command to the wheels."),
    RandomisedParameter("speed_noise", "", "Standard deviation of every command of speed, share of it."),
)
"""What is drawn, in the order of the record; the grey level of each material and object follows."""
DRAWN_DTYPE = np.dtype([(one.name, "f8") for one in DRAWN])
"""What kernels read of it: the same record whatever stands on the track, so that they compile once."""


def drawn_dtype(num_objects: int) -> np.dtype[Any]:
    """Return the record of one car's episode: `DRAWN`, then `grey_field` and so on, then `grey_object_0` and so on."""
    greys = [f"grey_{name.replace(' ', '_')}" for name in MATERIALS]
    objects = [f"grey_object_{k}" for k in range(num_objects)]
    return np.dtype([(name, "f8") for name in (*(one.name for one in DRAWN), *greys, *objects)])


def only(level: str, names: Iterable[str]) -> VariationConfig:
    """Return the variation that has some disturbances as a level has them, and no other.

    Raises:
        SettingError: There is no such level, or no such disturbance.
    """
    amounts = AMOUNTS[checked_level(level)]
    kept = [setting for name in names for setting in DISTURBANCES[checked_disturbance(name)].settings]
    values: dict[str, Any] = {name: 0.0 for name in RANGES} | {"lamps": False, "object_colours": False}
    for name in kept:
        values[name] = bool(amounts.get(name)) if isinstance(values[name], bool) else amounts.get(name, 0.0)
    return VariationConfig("off", **values)


def disturbances_of(level: str, has_objects: bool = True) -> list[str]:
    """Return the names of the disturbances that a level has; those of objects only where there are any."""
    amounts = AMOUNTS[checked_level(level)]
    return [
        name
        for name, one in DISTURBANCES.items()
        if any(amounts.get(part) for part in one.settings) and (has_objects or name != "object-colours")
    ]


def checked_level(level: str) -> str:
    """Return a level by which something differs.

    Raises:
        SettingError: There is none of that name.
    """
    known = [name for name in LEVELS if name != "off"]
    if level not in known:
        raise SettingError("There is no level of variation '{level}'. {hint}", level=level, hint=nearest(level, known))
    return level


def checked_disturbance(name: str) -> str:
    """Return the name of a disturbance.

    Raises:
        SettingError: There is none of that name.
    """
    if name not in DISTURBANCES:
        raise SettingError("There is no disturbance '{name}'. {hint}", name=name, hint=nearest(name, DISTURBANCES))
    return name


def as_table() -> str:
    """Return the disturbances and what each level has of them, as a Markdown table."""
    units = {field.name: field.metadata["unit"] for field in dataclasses.fields(VariationConfig)}
    levels = [level for level in LEVELS if level != "off"]
    lines = [
        f"| disturbance | setting | unit | {' | '.join(f'`{level}`' for level in levels)} |",
        "|---|---|---|" + "---|" * len(levels),
    ]
    for name, one in DISTURBANCES.items():
        for part in one.settings:
            amounts = [_cell(part, AMOUNTS[level].get(part, 0.0)) for level in levels]
            lines.append(f"| {name} | `variation.{part}` | {units[part]} | {' | '.join(amounts)} |")
    return "\n".join(lines)


def _cell(name: str, amount: float) -> str:
    if name in ("lamps", "object_colours"):
        return "yes" if amount else ""
    return f"{amount:.3g}" if amount else ""
