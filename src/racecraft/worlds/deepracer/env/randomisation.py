"""The cars of a race whose episodes differ: what each has drawn, and what it sees and drives with. Begin with `begin`.

A draw is a function of (seed, purpose, world and car, number of the car's episode), and every disturbance has places of
its own among an episode's draws: one that is switched on or off moves no other.

A race without variation has none of this.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.camera import OPTICS, Camera, CameraMount, mounted_optics
from racecraft.worlds.deepracer.env.kernels import variation as kernels
from racecraft.worlds.deepracer.env.scene import FIELD, MATERIALS, SKY, WALL_SOUTH
from racecraft.worlds.deepracer.env.variation import DRAWN, DRAWN_DTYPE, VariationConfig, drawn_dtype
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS

SUN_RGB = np.array([1.0, 1.0, 0.8])
AMBIENT, LAMP, LAMP_HEIGHT_M, LAMP_REACH = 0.5, 0.225, 15.0, (0.4, 0.01, 0.0)
"""Of the original's worlds (facts: deepracer.md 4.3): diffuse light of the sun, what shines from everywhere, the lamp
above, and how it weakens: one over constant + linear x distance + quadratic x distance²."""
SUN_FROM = np.array([0.5, -0.1, 0.9]) / math.sqrt(1.07)
"""Towards the sun, x east, y north, z up."""
GLARE_LOW_RAD, GLARE_HIGH_RAD = -0.4, 0.15
"""A glow stands so high: a lamp below the ceiling, or its reflection on the floor."""
PURPOSES = ("variation", "noise of commands", "noise of frames", "frames that fail")
EITHER_WAY = (
    "gain", "gradient_x", "gradient_y", "glare_azimuth", "camera_height", "camera_pitch", "camera_roll", "camera_view",
    "steering_gain", "steering_offset", "speed_gain",
)  # fmt: skip
"""What is drawn to either side of what it is without chance."""
LATENCY = [one.name for one in DRAWN].index("latency")
LAMP_DRAWS, MATERIAL_DRAWS = 9, 3 * len(MATERIALS)


class RandomisedCars:
    """N x M cars, each with an episode of its own kind.

    Args:
        config: What may differ, and by how much.
        camera: As it is without variation.
        grey_weights: (3,) of red, green and blue in the grey level that policies see.
        eyes: E, how many a car has.
        profiles: PROFILE (N, M), how cars answer without variation.
        kinds: Which kind each object of a world is, int64 (N, K).
    """

    def __init__(
        self,
        config: VariationConfig,
        camera: Camera,
        grey_weights: Array,
        eyes: int,
        profiles: Array,
        kinds: Array,
    ) -> None:
        self.config = config
        self._amounts = config.amounts
        self._camera, self._weights = camera, grey_weights
        self._ranges = self._ranges_of_draws()
        self._base, self._kinds = profiles, kinds
        shape, objects = profiles.shape, kinds.shape[1]
        self.drawn = np.zeros(shape, drawn_dtype(objects))
        """What every car's episode has drawn, (N, M); see `variation.DRAWN`."""
        self._read = np.zeros(shape, DRAWN_DTYPE)
        self.optics = np.zeros(shape, OPTICS)
        """Every car's camera."""
        self.palettes = np.zeros((*shape, len(MATERIALS) + objects))
        """The grey level of every material, and then of every object, to every car."""
        self.profiles = profiles.copy()
        """How every car answers steering and throttle."""
        self.paints = len(MATERIALS) - SKY - 1 + np.tile(np.arange(objects), (shape[0], 1))
        """Which row of a palette, behind the sky's, each object is painted with, (N, K)."""
        self.latency = np.zeros(shape, np.int64)
        """How many ticks every car's commands are under way."""
        most = round(self._amounts["latency"] / TICK_SECONDS)
        self._waiting = np.zeros((*shape, most + 1, 2))
        self._shown = np.zeros((*shape, eyes, camera.height, camera.width), np.uint8)
        self._keys = np.zeros((len(PURPOSES), *shape), np.uint64)
        self._draws = np.zeros((*shape, len(DRAWN) + LAMP_DRAWS + MATERIAL_DRAWS + 3 * objects))
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Give every car its streams of chance, which depend on no other world and no other car."""
        worlds, cars = self.drawn.shape
        for place, purpose in enumerate(PURPOSES):
            for m in range(cars):
                self._keys[place, :, m] = stream_keys(seed, f"{purpose} of car {m}", worlds)

    def begin(self, rows: Array, episodes: Array) -> None:
        """Draw the episodes (int64 (N, M)) that the cars of `rows` (bool (N, M)) begin."""
        kernels.draw_evenly(self._keys[0], rows, episodes, self._draws)
        draws = self._draws[rows]
        levels = self._levels(draws[:, len(DRAWN) :], self._kinds[np.nonzero(rows)[0]])
        amounts = self._drawn_from(draws[:, : len(DRAWN)])
        drawn = np.column_stack([amounts, levels]).view(self.drawn.dtype)[:, 0]
        self.drawn[rows], self.palettes[rows] = drawn, levels
        self._read[rows] = amounts.view(DRAWN_DTYPE)[:, 0]
        self.latency[rows] = np.rint(drawn["latency"] / TICK_SECONDS)
        self.profiles[rows] = self._answering(self._base[rows], drawn)
        self.optics[rows] = [self._mounted(one) for one in drawn]

    def send(self, cars: Array, chosen: Array) -> Array:
        """Return what reaches the cars this tick of what was chosen, float64 (N, M, 2): steering in rad, speed in m/s.

        `cars` are as before the tick.
        """
        sent = np.empty_like(chosen)
        kernels.send_late(self._read, self.latency, self._keys[1], cars, self._waiting, chosen, sent)
        return sent

    def show(self, cars: Array, rows: Array, frames: Array, is_last: bool = False) -> None:
        """Disturb the frames (N, M, E, H, W) of the cars of `rows`; `is_last` where their episodes end with them."""
        kernels.disturb_frames(
            self.optics, self._read, self.config.glare_width, self._keys[2], self._keys[3], cars, rows, is_last,
            self._shown, frames,
        )  # fmt: skip

    def save_state(self) -> dict[str, Array]:
        """Return what the cars need to go on besides the number of their episode."""
        return {
            "variation.keys": self._keys.copy(),
            "variation.waiting": self._waiting.copy(),
            "variation.shown": self._shown.copy(),
        }

    def load_state(self, state: Mapping[str, Array], episodes: Array) -> None:
        """Go on from a saved state; one saved without variation draws as its seed 0 does."""
        if "variation.keys" in state:
            self._keys = state["variation.keys"].reshape(self._keys.shape).copy()
            self._waiting[:], self._shown[:] = state["variation.waiting"], state["variation.shown"]
        self.begin(np.ones(self.drawn.shape, bool), episodes)

    def _drawn_from(self, draws: Array) -> Array:
        """Return what episodes have of everything in `DRAWN`, (R, D), of draws from 0 to 1 (R, D)."""
        least, most, either_way = self._ranges
        found = least + most * np.where(either_way, 2.0 * draws - 1.0, draws)
        ticks = round(self._amounts["latency"] / TICK_SECONDS)
        found[:, LATENCY] = TICK_SECONDS * np.floor(draws[:, LATENCY] * (ticks + 1))
        return found

    def _ranges_of_draws(self) -> tuple[Array, Array, Array]:
        """Return of everything in `DRAWN` what it is without chance, what chance adds, and whether either way, (D,)."""
        names = [one.name for one in DRAWN]
        amounts = {
            **self._amounts,
            "gradient_x": self._amounts["gradient"],
            "gradient_y": self._amounts["gradient"],
            "glare_azimuth": math.pi,
            "glare_elevation": GLARE_HIGH_RAD - GLARE_LOW_RAD,
        }
        least = dict.fromkeys(("gain", "steering_gain", "speed_gain"), 1.0)
        least |= {"glare_elevation": GLARE_LOW_RAD, "grain": self._camera.optics.grain}
        return (
            np.array([least.get(name, 0.0) for name in names]),
            np.array([amounts[name] for name in names]),
            np.isin(names, EITHER_WAY),
        )

    def _levels(self, draws: Array, kinds: Array) -> Array:
        """Return grey levels (R, P) of materials and objects, of draws from 0 to 1."""
        lamps, shares, of_objects = np.split(draws, (LAMP_DRAWS, LAMP_DRAWS + MATERIAL_DRAWS), axis=1)
        rows = len(draws)
        spread = self._amounts["palette"] * (2.0 * shares.reshape(rows, len(MATERIALS), 3) - 1.0)
        colours = self._camera.scene.palette * (1.0 + spread)
        objects = colours[np.arange(rows)[:, None], SKY + 1 + kinds]
        if self._amounts["object_colours"]:
            objects = 255.0 * of_objects.reshape(rows, -1, 3)
        if self._amounts["lamps"]:
            light = light_of_lamps(lamps)
            colours, objects = colours * light, objects * light[:, FIELD, None]
        levels: Array = np.clip(np.concatenate([colours, objects], axis=1), 0.0, 255.0) @ self._weights
        return levels

    def _answering(self, profiles: Array, drawn: Array) -> Array:
        """Return how cars answer, PROFILE (R,); gain, offset and noise of steering act on their commands."""
        answered = profiles.copy()
        answered["steering_lag"] += drawn["steering_lag"]
        answered["speed_gain"] *= drawn["speed_gain"]
        slips = drawn["slip"] > 0.0
        answered["grip"] = np.where(slips, 1.0 / (1.0 / profiles["grip"] + drawn["slip"]), profiles["grip"])
        return answered

    def _mounted(self, one: Any) -> tuple[float, ...]:
        mount = self._camera.mount
        moved = CameraMount(
            mount.x,
            mount.z + float(one["camera_height"]),
            mount.pitch + float(one["camera_pitch"]),
            mount.horizontal_view + float(one["camera_view"]),
            mount.roll + float(one["camera_roll"]),
        )
        optics = mounted_optics(self._camera.width, self._camera.height, moved)
        return optics._replace(grain=float(one["grain"]))


def light_of_lamps(draws: Array) -> Array:
    """Return how much more red, green and blue each material shows in lamps of any colour, (R, M, 3).

    The original gives sun and lamp a diffuse colour from 0 to 1 each, and the lamp three numbers by which it weakens,
    from 0 to 1 each: 15 m away it then nearly vanishes. What shines from everywhere stays (facts: deepracer.md 7). The
    light is Lambert's, compared with that of the original's own sun and lamp; the sky keeps its colour.

    Args:
        draws: From 0 to 1 (R, 9): the sun's colour, the lamp's, constant, linear and quadratic.
    """
    to_sun = np.zeros(len(MATERIALS))
    to_sun[:] = SUN_FROM[2]
    inward = np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])  # normals of south, east, north, west wall
    to_sun[WALL_SOUTH:SKY] = np.maximum(inward @ SUN_FROM[:2], 0.0)
    sun, lamp, (constant, linear, quadratic) = draws[:, 0:3], draws[:, 3:6], draws[:, 6:9].T
    weakened = lamp / (constant + linear * LAMP_HEIGHT_M + quadratic * LAMP_HEIGHT_M**2)[:, None]
    own = AMBIENT + to_sun[:, None] * SUN_RGB + LAMP / (LAMP_REACH[0] + LAMP_REACH[1] * LAMP_HEIGHT_M)
    light: Array = (AMBIENT + to_sun[:, None] * sun[:, None] + weakened[:, None]) / own
    light[:, SKY] = 1.0
    return light


def plain_optics(camera: Camera, shape: tuple[int, int]) -> Array:
    """Return the camera of cars that all see alike, OPTICS (N, M)."""
    optics: Array = np.full(shape, np.array(tuple(camera.optics), OPTICS))
    return optics
