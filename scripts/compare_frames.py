"""Lay our frames beside the original's: fit the unknown pose of each reference frame, measure, write pictures.

    python scripts/compare_frames.py [FOLDER] [--out out/frames]

FOLDER holds camera frames of re:Invent 2018, 160 x 120 PNG, whose poses were not recorded. For each frame the pose is
searched over the whole road, at 40 x 30, then refined at larger sizes (Gauss-Newton on blurred colours, many starts at
once). Two numbers judge a frame: the median distance in pixels between the edges of the white lines in both pictures,
and the difference of the mean grey level. Pictures go to an ignored folder: the original above, ours below.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image
from scipy.ndimage import binary_erosion, distance_transform_edt, gaussian_filter, zoom

from racecraft.worlds.deepracer.env.camera import Camera, mount_for_version
from racecraft.worlds.deepracer.env.scene import GREY_WEIGHTS, Scene, build_scene
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

FRAMES_MOUNT = mount_for_version("1")
"""The reference frames are of 2019: they are looked at through the eyes that a car of version 1 has here."""
EDGE_PX, GREY_LEVELS = 1.0, 10.0
"""A frame agrees if its line edges lie within so many pixels (median) and its mean grey within so many levels."""
WHITE_BLUE_LEVEL = 150
"""Blue level above which a pixel is white line; nothing else on that circuit is so blue."""


class Comparison(NamedTuple):
    """What was found, one row for each of the R frames."""

    poses: np.ndarray
    """(R, 3) m, m, rad."""
    edge_px: np.ndarray
    """(R,) median distance between the line edges."""
    grey: np.ndarray
    """(R,) ours less the original's mean grey level."""
    ours: np.ndarray
    """(R, 120, 160, 3) uint8."""

    def agrees(self) -> np.ndarray:
        """(R,) bool: both numbers are within their bounds."""
        return (self.edge_px <= EDGE_PX) & (np.abs(self.grey) <= GREY_LEVELS)


def compare(frames: np.ndarray) -> Comparison:
    """Fit and judge frames (R, 120, 160, 3) uint8 of re:Invent 2018."""
    track = load_track("reinvent_base")
    scene = build_scene(track, "2019")._replace(
        wall_height=5.0
    )  # the classic simulator's walls reach out of the picture
    poses = fit_poses(track, scene, frames)
    ours = Camera(scene, 160, 120, FRAMES_MOUNT).render_rgb(poses)
    edges = np.array([line_edge_distance(a, b) for a, b in zip(ours, frames, strict=True)])
    grey = (ours @ GREY_WEIGHTS).mean(axis=(1, 2)) - (frames @ GREY_WEIGHTS).mean(axis=(1, 2))
    return Comparison(poses, edges, grey, ours)


def read_frames(folder: Path) -> np.ndarray:
    """Read all PNG files of a folder in the order of their names, (R, H, W, 3) uint8."""
    return np.stack([np.array(Image.open(path).convert("RGB")) for path in sorted(folder.glob("*.png"))])


def line_edge_distance(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the median distance in pixels between white-line edges of two frames (H, W, 3), both ways."""
    edges = []
    for frame in (ours, theirs):
        white = zoom(frame[..., 2].astype(np.float32), 4, order=1) > WHITE_BLUE_LEVEL
        edges.append(white & ~binary_erosion(white, border_value=1))
    if not edges[0].any() or not edges[1].any():
        return 0.0 if not edges[0].any() and not edges[1].any() else math.inf
    there, back = (distance_transform_edt(~edges[k])[edges[1 - k]] for k in range(2))
    return float(np.median(np.concatenate([there, back]))) / 4


def fit_poses(track: Track, scene: Scene, frames: np.ndarray, starts: int = 16) -> np.ndarray:
    """Return the (R, 3) poses from which our frames look most like the given ones."""
    rows, poses = _starting_poses(track, scene, frames, starts)
    for width, keep in ((40, 4), (80, 2), (160, 1)):
        poses, costs = _refine(scene, frames, rows, poses, width)
        best = [np.flatnonzero(rows == row)[np.argsort(costs[rows == row])[:keep]] for row in range(len(frames))]
        chosen = np.concatenate(best)
        rows, poses = rows[chosen], poses[chosen]
    return poses


def _starting_poses(track: Track, scene: Scene, frames: np.ndarray, starts: int) -> tuple[np.ndarray, np.ndarray]:
    """Render the road from everywhere at 40 x 30; return the most alike poses of each frame and their frame's row."""
    arcs, sides, turns = np.arange(0, track.length, 0.15), np.linspace(-0.5, 0.5, 7), np.radians(np.arange(-56, 57, 8))
    along = np.array([track.pose_at(arc) for arc in arcs])[:, None, None]
    x = along[..., 0] - np.sin(along[..., 2]) * sides[:, None] + 0 * turns
    y = along[..., 1] + np.cos(along[..., 2]) * sides[:, None] + 0 * turns
    yaw = along[..., 2] + turns + 0 * sides[:, None]
    grid = np.stack([x, y, yaw], axis=-1).reshape(-1, 3)
    seen = _blurred(Camera(scene, 40, 30, FRAMES_MOUNT).render_rgb(grid), 1.0)[:, 3:].reshape(len(grid), -1)
    wanted = _blurred(_shrunk(frames, 4), 1.0)[:, 3:].reshape(len(frames), -1)
    unlike = (wanted**2).sum(1)[:, None] + (seen**2).sum(1) - 2 * wanted @ seen.T
    rows, poses = [], []
    for row in range(len(frames)):
        chosen: list[int] = []
        for place in np.argsort(unlike[row])[:4000]:
            apart = np.abs(grid[place] - grid[chosen]) if chosen else np.full((1, 3), np.inf)
            if (np.hypot(apart[:, 0], apart[:, 1]) + apart[:, 2] > 0.22).all():
                chosen.append(int(place))
            if len(chosen) == starts:
                break
        rows += [row] * len(chosen)
        poses += [grid[place] for place in chosen]
    return np.array(rows), np.array(poses)


def _refine(scene: Scene, frames: np.ndarray, rows: np.ndarray, poses: np.ndarray, width: int, rounds: int = 9):
    """Walk poses (P, 3) towards frames `rows` (P,) by damped Gauss-Newton with bounded residuals; return also costs."""
    factor = 160 // width
    top = 30 // (2 * factor)  # the walls' plain upper part tells nothing
    camera = Camera(scene, width, width * 3 // 4, FRAMES_MOUNT)
    wanted = _blurred(_shrunk(frames, factor), 0.7)[:, top:]

    def look(places: np.ndarray) -> np.ndarray:
        return _blurred(camera.render_rgb(places), 0.7)[:, top:]

    step = 0.005 * (2 if factor == 4 else 1)
    best, least, damping = poses.copy(), np.full(len(poses), np.inf), np.full(len(poses), 0.01)
    for turn in range(rounds + 1):
        miss = look(poses) - wanted[rows]
        cost = np.minimum(np.abs(miss), 60).mean(axis=(1, 2, 3))
        better = cost < least
        best[better], least[better] = poses[better], cost[better]
        damping = np.where(better, damping * 0.5, damping * 4)
        if turn == rounds:
            break
        shifts = np.eye(3) * step
        slopes = [(look(poses + shift) - look(poses - shift)) / (2 * step) for shift in shifts]
        slope = np.stack(slopes, axis=-1).reshape(len(poses), -1, 3)
        trust = (1 / np.maximum(1, np.abs(miss) / 12)).reshape(len(poses), -1, 1)
        curvature = np.swapaxes(slope, 1, 2) @ (trust * slope)
        pull = np.swapaxes(slope, 1, 2) @ (trust * miss.reshape(len(poses), -1, 1))
        curvature += np.eye(3) * (curvature * damping[:, None, None] + 1e-3)
        poses = poses - np.clip(np.linalg.solve(curvature, pull)[..., 0], -0.1, 0.1)
    return best, least


def _blurred(frames: np.ndarray, sigma: float) -> np.ndarray:
    return gaussian_filter(frames.astype(np.float32), (0, sigma, sigma, 0))


def _shrunk(frames: np.ndarray, factor: int) -> np.ndarray:
    count, height, width, channels = frames.shape
    blocks = frames.reshape(count, height // factor, factor, width // factor, factor, channels)
    return blocks.mean(axis=(2, 4), dtype=np.float32)


def write_sheets(frames: np.ndarray, found: Comparison, folder: Path, columns: int = 6, lines: int = 3) -> None:
    """Write pictures of many pairs each, the original above and ours below."""
    folder.mkdir(parents=True, exist_ok=True)
    each = columns * lines
    for first in range(0, len(frames), each):
        sheet = Image.new("RGB", (columns * 164, lines * 248))
        for place, row in enumerate(range(first, min(first + each, len(frames)))):
            corner = (place % columns * 164, place // columns * 248)
            sheet.paste(Image.fromarray(frames[row]), corner)
            sheet.paste(Image.fromarray(found.ours[row]), (corner[0], corner[1] + 121))
        sheet.save(folder / f"sheet-{first:03d}.png")


def main() -> None:
    """Read, compare, write, tell."""
    here = Path(__file__).resolve().parents[1]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, default=here / ".." / "shared" / "data" / "frames")
    parser.add_argument("--out", type=Path, default=here / "out" / "frames")
    options = parser.parse_args()
    frames = read_frames(options.folder)
    found = compare(frames)
    write_sheets(frames, found, options.out)
    for row in range(len(frames)):
        x, y, yaw = found.poses[row]
        print(f"{row:3d}  x {x:6.2f}  y {y:6.2f}  yaw {math.degrees(yaw):7.1f}  "
              f"edges {found.edge_px[row]:5.2f} px  grey {found.grey[row]:+5.1f}")  # fmt: skip
    edges, grey = found.edge_px <= EDGE_PX, np.abs(found.grey) <= GREY_LEVELS
    print(f"edges within {EDGE_PX} px on {edges.sum()}, mean grey within {GREY_LEVELS} on {grey.sum()}, "
          f"both on {found.agrees().sum()} of {len(frames)} frames; pictures in {options.out}")  # fmt: skip


if __name__ == "__main__":
    main()
