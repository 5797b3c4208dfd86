"""What a run's cars see, rendered from a pose long after it was driven, or while it is driven elsewhere."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import from_dictionary
from racecraft.worlds.deepracer.env.camera import Camera, mount_for_version
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.light import light_for
from racecraft.worlds.deepracer.env.objects import KINDS, ObjectPlan
from racecraft.worlds.deepracer.env.placing import plan_objects
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.settings import CameraConfig, objects_of
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.players.run_courses import LaidCourse

FOR_PEOPLE = (320, 240)
"""Pixels of the view for people; the policy's has its own size."""
QUALITY = 82


class OnboardCamera:
    """Renders what a car of a run sees on one of its courses.

    Args:
        course: The course: its circuit, its race, what stands or drives in the way.
        job: What the run was asked for, as `RunFolder.read_job` tells it.
    """

    def __init__(self, course: LaidCourse, job: dict[str, Any]) -> None:
        settings = from_dictionary(Settings(camera=CameraConfig()), job["settings"])
        mount = mount_for_version(job["model_metadata"].get("version"))
        light = light_for(settings.camera.light, course.race.car)
        track = course.track.reversed() if course.race.reverse else course.track
        self.objects = objects_on(course)
        self._people = Camera(build_scene(track, light, for_people=True), *FOR_PEOPLE, mount)
        scene = build_scene(track, light, settings.camera.grass)
        self._policy = Camera(scene, settings.camera.width, settings.camera.height, mount)

    def jpeg(self, x_m: float, y_m: float, yaw_rad: float, places: Array | None = None) -> bytes:
        """Return the view for people, in colour, from the pose of a car's front point.

        `places` are x, y (m) and yaw (rad) of every box and bot, (K, 3) in the order of `objects`; None: an empty road.
        """
        frame = self._people.render_rgb(_base_link(x_m, y_m, yaw_rad), boxes=self._boxes(places))[0]
        return _encoded(frame, "JPEG", quality=QUALITY)

    def policy_png(self, x_m: float, y_m: float, yaw_rad: float, places: Array | None = None) -> bytes:
        """Return what the policy is given there, pixel by pixel, in its own size; `places` as for `jpeg`."""
        frame = self._policy.render_grey(_base_link(x_m, y_m, yaw_rad), boxes=self._boxes(places))[0]
        return _encoded(frame, "PNG")

    def _boxes(self, places: Array | None) -> tuple[Array, Array] | None:
        """Return one frame's objects as a camera takes them, (1, K, 6) and (1, K)."""
        if places is None or not len(self.objects.kinds):
            return None
        return np.concatenate([places, self.objects.sizes], axis=1)[None], self.objects.kinds[None]


def objects_on(course: LaidCourse) -> ObjectPlan:
    """Return what stands or drives on a course: kinds and sizes, in the order in which places are told."""
    return plan_objects(course.track, objects_of(course.settings), habits(course.race.fidelity))


def objects_on_page(plan: ObjectPlan) -> list[dict[str, Any]]:
    """Return boxes and bots as a page draws them: kind, length and width in m, its colour as CSS."""
    rows = zip(plan.kinds.tolist(), plan.sizes.tolist(), strict=True)
    return [
        {
            "kind": KINDS[kind].name,
            "length": 2 * half_length,
            "width": 2 * half_width,
            "colour": "#{:02x}{:02x}{:02x}".format(*(round(level) for level in KINDS[kind].colour)),
        }
        for kind, (half_length, half_width, _) in rows
    ]


def _base_link(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    """Return the pose (1, 3) of base_link, which cameras take, of a front point's."""
    return np.array([[x_m - FRONT_POINT_M * np.cos(yaw_rad), y_m - FRONT_POINT_M * np.sin(yaw_rad), yaw_rad]])


def _encoded(pixels: np.ndarray, kind: str, **how: Any) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, kind, **how)
    return out.getvalue()
