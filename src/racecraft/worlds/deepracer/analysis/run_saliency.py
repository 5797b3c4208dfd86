"""Look into a run's policy: over a lap that it drives for it, over pictures, over a film. Begin with `look_at_lap`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.analysis.attribution import (
    TAKEN,
    AttentionError,
    ExplainTarget,
    Recording,
    SeeingPolicy,
    changed,
    confidence,
)
from racecraft.analysis.video import read_film
from racecraft.contract.world import Array, ArraySpec
from racecraft.players.trained import TrainedPolicy
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.lap_film import HEIGHT as FILM_HEIGHT
from racecraft.worlds.deepracer.analysis.lap_film import VIEW_WIDTH
from racecraft.worlds.deepracer.analysis.lap_film import WIDTH as FILM_WIDTH
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries, look_at
from racecraft.worlds.deepracer.analysis.saliency_film import CarPositions
from racecraft.worlds.deepracer.analysis.saliency_page import LapSaliency
from racecraft.worlds.deepracer.analysis.surfaces import (
    SURFACES,
    SurfaceAttention,
    by_surface,
    eye_poses,
    painted_over,
    surface_shares,
)
from racecraft.worlds.deepracer.env.sensors import STEREO_GREY_WEIGHTS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.track import Track

IN_SIGHT = 0.002
"""Share of the picture from which a surface counts as seen in a tick."""
PICTURES = (".png", ".jpg", ".jpeg")
FILMS = (".mp4", ".mkv", ".mov", ".avi", ".webm")
GREY = (0.2989, 0.587, 0.114)
"""Of red, green and blue in the grey that policies see (facts: simapp observation filter)."""


def look_at_lap(car: TrainedCar, track: Track, question: ExplainTarget = TAKEN) -> LapSaliency:
    """Let a car drive one lap and explain every tick of it.

    Args:
        car: Whose policy.
        track: Where.
        question: Which part of the action.

    Raises:
        AttentionError: It sees no picture.
    """
    eyes, keeper = SeeingPolicy(car.policy), DriveKeeper()
    world = car.world(track, num_cars=1, start_shares=[0.0], laps=1)
    judge_laps(eyes, world, 1, [keeper])
    drive = Drive.from_reports(keeper.drive)
    look = look_at(car.policy, eyes.seen, car.policy.spec.actions, question)
    surfaces = _surfaces(car.policy, world, look, eyes.seen, keeper)
    last = len(drive) - 1
    return LapSaliency(look, CarPositions(world.track, drive.xy), drive.progress_percent, surfaces, drive.outcome(last))


def _surfaces(
    policy: TrainedPolicy, world: RaceWorld, look: SaliencySeries, seen: Recording, keeper: DriveKeeper
) -> list[SurfaceAttention]:
    """Return what each surface gets, and what painting it over changes; nothing where the frames are not the camera's.

    Both sides of a comparison are rendered here, in daylight: what chance did to the light of the lap is no surface.
    """
    camera = world.camera
    if look.frames.shape[1:] != (camera.height, camera.width):
        return []
    reports, objects = keeper.drive, keeper.objects
    poses = np.column_stack([reports["x"], reports["y"], reports["yaw"]])
    eyes = [eye_poses(poses, float(left)) for left in world.sensors.eyes_left_m]
    shares = np.mean([surface_shares(camera, eye, objects) for eye in eyes], axis=0)
    rows = by_surface(look.heat, shares)
    if policy.spec.stack_size > 1:
        return rows  # one moment of a stack cannot be repainted without those before it
    is_pair = len(eyes) > 1
    levels = camera.scene.palette @ STEREO_GREY_WEIGHTS if is_pair else camera.scene.grey_palette

    def frames(of_eye: Callable[[Array], Array]) -> dict[str, Array]:
        views = [of_eye(eye) for eye in eyes]
        return {look.name: np.stack(views, axis=-1) if is_pair else views[0].reshape(-1, *shape)}

    shape = policy.spec.visible[look.name].shape
    plain = frames(lambda eye: camera.render_grey(eye, palettes=levels, boxes=objects))
    as_driven = confidence(policy, seen.instead(policy, plain))
    found = []
    for row in rows:
        painted = frames(lambda eye, surface=row.surface: painted_over(camera, eye, surface, levels, objects))  # type: ignore[misc]
        others = changed(as_driven, confidence(policy, seen.instead(policy, painted)))
        in_sight = shares[:, SURFACES.index(row.surface)].mean(axis=(1, 2)) > IN_SIGHT
        share = float(others[in_sight].mean()) if in_sight.any() else 0.0
        found.append(SurfaceAttention(row.surface, row.area, row.attention, share))
    return found


def look_at_pictures(policy: TrainedPolicy, source: Path, question: ExplainTarget = TAKEN) -> SaliencySeries:
    """Explain what a policy would decide at a picture, at each of a folder, or through a film.

    Pictures stand each for itself; in a film a policy with a memory remembers what came before.

    Args:
        policy: Who looks; it sees through one camera.
        source: A picture, a folder of them, or a film. Of racecraft's own films the camera's half is taken.
        question: Which part of the action.

    Raises:
        AttentionError: The policy does not see through one camera, or there is no picture.
    """
    name, spec = _only_camera(policy)
    height, width = spec.shape[:2]
    eyes = SeeingPolicy(policy)
    everyone = np.ones(1, bool)
    policy.reset_state(everyone)
    follows = source.suffix.lower() in FILMS
    for picture in _pictures_of(source):
        if not follows:
            policy.reset_state(everyone)
        eyes.act({name: as_seen(picture, width, height, spec)[None]})
    return look_at(policy, eyes.seen, policy.spec.actions, question)


def _only_camera(policy: TrainedPolicy) -> tuple[str, ArraySpec]:
    """Return the one observation a policy sees, which a picture can stand for."""
    visible = policy.spec.visible
    if len(visible) == 1:
        ((name, spec),) = visible.items()
        if np.dtype(spec.dtype) == np.uint8 and (len(spec.shape) == 2 or spec.shape[2:] in ((1,), (3,))):
            return name, spec
    names = ", ".join(f"{name} {spec.shape}" for name, spec in visible.items())
    raise AttentionError(
        "this policy sees {told}; a picture can only stand for one camera. Look at a lap instead: leave the picture "
        "away.",
        told=names,
    )


def _pictures_of(source: Path) -> Iterator[Array]:
    """Yield pictures, (H, W, 3) uint8."""
    if source.suffix.lower() in FILMS:
        for picture in read_film(source):
            is_ours = picture.shape[:2] == (FILM_HEIGHT, FILM_WIDTH)
            yield picture[:, :VIEW_WIDTH] if is_ours else picture
        return
    for path in pictures_in(source):
        yield _read(path)


def pictures_in(source: Path) -> Sequence[Path]:
    """Return the pictures of a folder in the order of their names, or the one picture.

    Raises:
        AttentionError: There is none.
    """
    if source.is_dir():
        found = sorted(path for path in source.iterdir() if path.suffix.lower() in PICTURES)
        if not found:
            raise AttentionError(
                "{source}: holds no picture; expected files that end in {pictures}.",
                source=source,
                pictures=", ".join(PICTURES),
            )
        return found
    if not source.is_file():
        raise AttentionError(
            "{source}: is not there; expected a picture, a folder of pictures or a film.", source=source
        )
    return [source]


def _read(path: Path) -> Array:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as picture:
            return np.asarray(picture.convert("RGB"))
    except (OSError, UnidentifiedImageError) as error:
        raise AttentionError(
            "{path}: cannot be read as a picture ({error}); expected PNG or JPEG.", path=path, error=error
        ) from error


def as_seen(picture: Array, width: int, height: int, spec: ArraySpec) -> Array:
    """Return a picture (H, W, 3) as a policy would see it: cut to its shape in the middle, scaled by area, grey.

    Args:
        picture: uint8.
        width: Pixels the policy sees.
        height: Likewise.
        spec: Of its camera; with three channels colours stay.
    """
    from PIL import Image

    high, wide = picture.shape[:2]
    keep_wide, keep_high = min(wide, round(high * width / height)), min(high, round(wide * height / width))
    left, top = (wide - keep_wide) // 2, (high - keep_high) // 2
    cut = Image.fromarray(np.ascontiguousarray(picture[top : top + keep_high, left : left + keep_wide]))
    small: Any = np.asarray(cut.resize((width, height), Image.Resampling.BOX))
    if spec.shape[2:] == (3,):
        return np.asarray(small)
    grey = np.clip(np.rint(small @ np.array(GREY)), 0, 255).astype(np.uint8)
    return grey[..., None] if spec.shape[2:] == (1,) else grey
