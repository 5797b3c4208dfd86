"""What a run's cars see, rendered from a pose long after it was driven, or while it is driven elsewhere."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from racecraft.envs.deepracer.camera import Camera
from racecraft.envs.deepracer.light import light_for
from racecraft.envs.deepracer.scene import build_scene
from racecraft.envs.deepracer.settings import CameraConfig, RaceConfig
from racecraft.envs.deepracer.vehicle import FRONT_POINT_M
from racecraft.envs.deepracer.world import mount_for_version
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import from_dictionary
from racecraft.tracks.track import Track

FOR_PEOPLE = (320, 240)
"""Pixels of the view for people; the policy's has its own size."""
QUALITY = 82


class OnboardCamera:
    """Renders what a car of a run sees.

    Args:
        track: The circuit as it was driven.
        job: What the run was asked for, as `RunFolder.read_job` tells it.
    """

    def __init__(self, track: Track, job: dict[str, Any]) -> None:
        settings = from_dictionary(Settings(race=RaceConfig(), camera=CameraConfig()), job["settings"])
        mount = mount_for_version(job["model_metadata"].get("version"))
        light = light_for(settings.camera.light, settings.race.car)
        self._people = Camera(build_scene(track, light, for_people=True), *FOR_PEOPLE, mount)
        scene = build_scene(track, light, settings.camera.grass)
        self._policy = Camera(scene, settings.camera.width, settings.camera.height, mount)

    def jpeg(self, x_m: float, y_m: float, yaw_rad: float) -> bytes:
        """Return the view for people, in colour, from the pose of a car's front point."""
        return _encoded(self._people.render_rgb(_base_link(x_m, y_m, yaw_rad))[0], "JPEG", quality=QUALITY)

    def policy_png(self, x_m: float, y_m: float, yaw_rad: float) -> bytes:
        """Return what the policy is given there, pixel by pixel, in its own size."""
        return _encoded(self._policy.render_grey(_base_link(x_m, y_m, yaw_rad))[0], "PNG")


def _base_link(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    """Return the pose (1, 3) of base_link, which cameras take, of a front point's."""
    return np.array([[x_m - FRONT_POINT_M * np.cos(yaw_rad), y_m - FRONT_POINT_M * np.sin(yaw_rad), yaw_rad]])


def _encoded(pixels: np.ndarray, kind: str, **how: Any) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, kind, **how)
    return out.getvalue()
