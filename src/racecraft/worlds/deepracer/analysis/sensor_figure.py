"""What a car's policy is shown, as a picture: frames pixel by pixel, beams on the map. Begin with `draw_sight`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.figures import save_figure
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE, INK, PAPER, QUIET
from racecraft.worlds.deepracer.analysis.path_picture import DARK_RED
from racecraft.worlds.deepracer.env.sensors import BEAM_STEP_RAD, FIRST_BEAM_RAD, STEREO, LidarView
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.lidar_config import BEAMS
from racecraft.worlds.deepracer.tracks.picture import paint_ground

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BODY = np.array([(0.166, 0.094), (0.166, -0.094), (-0.158, -0.094), (-0.158, 0.094)])
"""Corners of a car's body from base_link: ahead and left, m."""
MAP_HALF_M = 1.8
"""The map reaches at least so far around the car."""
FREE = "#ffffff"


def draw_sight(world: RaceWorld, seen: Mapping[str, Array], title: str, path: Path | None = None) -> Figure:
    """Draw what the first car of the first world is shown, and where on the road it stands.

    Args:
        world: The car stands in it.
        seen: The world's observations, (N, M, …) each.
        title: Headline.
        path: File to write (.png, .svg, .pdf by its ending); None writes none.

    Raises:
        FigureError: The path has another ending.
        OutputFileError: It cannot be written.
    """
    figure, frames, text_axes, ground = _sheet(world)
    lidar = world.sensors.lidar
    _draw_frames(frames, world, seen[world.sensors.camera_name][0, 0])
    if lidar is not None:
        _draw_lidar_input(text_axes, lidar, seen[lidar.name][0, 0])
    _draw_map(ground, world)
    figure.text(0.05, 0.965, title, fontsize=15, fontweight="bold", color=INK, va="top")
    figure.text(0.05, 0.905, _facts(world), fontsize=9, color=QUIET, va="top")
    if path is not None:
        save_figure(figure, path, dpi=130)
    return figure


def _sheet(world: RaceWorld) -> tuple[Figure, list[Axes], Axes, Axes]:
    """Return a figure, and axes for each eye's frame, for what the LiDAR tells (hidden without one), for the map."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    eyes, has_lidar = len(world.sensors.eyes_left_m), world.sensors.lidar is not None
    figure = Figure(figsize=(14.0, 6.4 if has_lidar else 5.6), facecolor=PAPER)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(
        2, 3, width_ratios=(1, 1, 1.15), height_ratios=(1.5, 1) if has_lidar else (1, 0.001),
        left=0.05, right=0.985, top=0.82, bottom=0.09 if has_lidar else 0.03, wspace=0.06, hspace=0.2,
    )  # fmt: skip
    frames = [figure.add_subplot(grid[0, eye]) for eye in range(2)] if eyes == 2 else [
        figure.add_subplot(grid[0, :2])
    ]  # fmt: skip
    text_axes = figure.add_subplot(grid[1, :2])
    text_axes.set_visible(has_lidar)
    return figure, frames, text_axes, figure.add_subplot(grid[:, 2])


def _draw_frames(axes: list[Axes], world: RaceWorld, frame: Array) -> None:
    """Draw each eye's frame (H, W) or (H, W, 2), every pixel as it is."""
    is_stereo = world.sensors.camera == STEREO
    by_eye = np.moveaxis(frame, -1, 0) if is_stereo else frame[None]
    names = ("left eye", "right eye") if is_stereo else (world.sensors.camera,)
    for one, picture, name in zip(axes, by_eye, names, strict=True):
        one.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
        one.set_title(name, fontsize=10, color=INK, loc="left")
        one.set_xticks([])
        one.set_yticks([])


def _draw_lidar_input(axes: Any, lidar: LidarView, view: Array) -> None:
    """Draw what the policy is told of a LiDAR, from the left of its nose to the right, as a driver would read it."""
    axes.set_title(f"{lidar.name}, {len(view)} numbers, as the network gets them", fontsize=10, color=INK, loc="left")
    axes.invert_xaxis()
    if lidar.sectors:
        cells = view.reshape(lidar.sectors, lidar.values)
        axes.imshow(
            cells.T, cmap="Blues", vmin=0, vmax=1.4, aspect="auto", origin="lower",
            extent=(-0.5, lidar.sectors - 0.5, 0.0, lidar.clip_m),
        )  # fmt: skip
        axes.set_xlim(lidar.sectors - 0.5, -0.5)
        axes.set_xticks(np.arange(-0.5, lidar.sectors), labels=[])
        axes.set_yticks(np.linspace(0.0, lidar.clip_m, lidar.values + 1) if lidar.values <= 10 else [0.0, lidar.clip_m])
        axes.grid(color="#c9d1d6", lw=0.8)
        axes.set_xlabel("sector, left to right of its nose", fontsize=9, color=QUIET)
        axes.set_ylabel("nearest thing (m)", fontsize=9, color=QUIET)
        if not view.any():
            reach = f"all 0: nothing within {lidar.clip_m:g} m"
            axes.text(0.5, 0.5, reach, fontsize=10, color=QUIET, ha="center", va="center", transform=axes.transAxes)
    else:
        degrees = np.degrees(FIRST_BEAM_RAD + BEAM_STEP_RAD * np.arange(BEAMS))
        met = view < lidar.clip_m
        width = 0.8 * math.degrees(BEAM_STEP_RAD)
        axes.bar(degrees, view, width=width, color=np.where(met, DARK_RED, "#c9d1d6"))
        axes.set_ylim(0, lidar.clip_m * 1.05)
        axes.set_xticks(np.arange(-150, 151, 50))
        axes.set_xlabel("beam, degrees left of its nose", fontsize=9, color=QUIET)
        axes.set_ylabel("distance (m)", fontsize=9, color=QUIET)
    axes.tick_params(labelsize=8, colors=INK, length=2)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _draw_map(axes: Any, world: RaceWorld) -> None:
    """Draw the road around the car, what is in frame, and the beams as far as the policy is told of them."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Polygon

    car = world.cars[0, 0]
    x, y, yaw = float(car["x"]), float(car["y"]), float(car["yaw"])
    half = max(MAP_HALF_M, 1.15 * world.lidar.reach) if world.sensors.lidar else MAP_HALF_M
    axes.set_aspect("equal")
    paint_ground(axes, world.track)
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), xticks=[], yticks=[])
    axes.set_title("where it stands", fontsize=10, color=INK, loc="left")
    for box in world.boxes[0]:
        axes.add_patch(
            Polygon(
                _corners(box[0], box[1], box[2], _rectangle(box[3], box[4])), fc="#a9825f", ec=INK, lw=0.8, zorder=6
            )
        )
    _draw_view(axes, world, x, y, yaw)
    if world.sensors.lidar is not None:
        eye = np.array([x + world.lidar.x * math.cos(yaw), y + world.lidar.x * math.sin(yaw)])
        ranges = world.lidar_ranges[0, 0]
        angles = yaw + world.lidar.yaw + FIRST_BEAM_RAD + BEAM_STEP_RAD * np.arange(BEAMS)
        ends = eye + ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        met = ranges < world.sensors.lidar.clip_m
        lines = [(eye, end) for end in ends]
        axes.add_collection(LineCollection(lines, colors=np.where(met, DARK_RED, FREE), linewidths=0.7, zorder=8))
        axes.scatter(*ends[met].T, s=14, c=DARK_RED, zorder=9)
    axes.add_patch(Polygon(_corners(x, y, yaw, BODY), fc=BLUE, ec=FREE, lw=1.0, zorder=10))


def _rectangle(half_length: float, half_width: float) -> Array:
    return np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) * (half_length, half_width)


def _corners(x: float, y: float, yaw: float, outline: Array) -> Array:
    """Return the points (P, 2) of an outline that was drawn ahead and left of where something stands."""
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    placed: Array = outline @ turn + (x, y)
    return placed


def _draw_view(axes: Any, world: RaceWorld, x: float, y: float, yaw: float) -> None:
    """Draw the wedge that a camera has in view, from each eye."""
    from matplotlib.patches import Polygon

    mount, far = world.camera.mount, 3.0 * MAP_HALF_M
    for left in world.sensors.eyes_left_m:
        eye_x = x + mount.x * math.cos(yaw) - left * math.sin(yaw)
        eye_y = y + mount.x * math.sin(yaw) + left * math.cos(yaw)
        corners = [(eye_x, eye_y)] + [
            (eye_x + far * math.cos(yaw + side), eye_y + far * math.sin(yaw + side))
            for side in (mount.horizontal_view / 2, -mount.horizontal_view / 2)
        ]
        axes.add_patch(Polygon(corners, fc="#ffe08a", ec="#ffe08a", alpha=0.22, lw=1.0, zorder=7))


def _facts(world: RaceWorld) -> str:
    sensors = world.sensors.specs(world.camera.width, world.camera.height)
    shapes = [f"{name} {np.dtype(part.dtype).name} {part.shape}" for name, part in sensors.items()]
    if world.sensors.lidar is not None:
        nose = "backward" if math.cos(world.lidar.yaw) < 0 else "forward"
        shapes.append(f"LiDAR looks {nose}, {world.lidar.hertz} readings a second")
    return "   ·   ".join(shapes)
