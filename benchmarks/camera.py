"""How long one core takes to render a frame: `python benchmarks/camera.py`."""

from __future__ import annotations

import time

import numpy as np

from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.tracks.catalogue import load_track

SIZES = ((160, 120), (80, 60), (40, 30))


def microseconds_per_frame(track_name: str, width: int, height: int, cars: int = 64, rounds: int = 60) -> float:
    """Return the best of `rounds` on one core: microseconds of a grey frame, cars spread over the circuit."""
    set_threads(1)
    track = load_track(track_name)
    camera = Camera(build_scene(track), width, height)
    rng = np.random.default_rng(1)
    poses = np.array([track.pose_at_share(share) for share in np.linspace(0, 1, cars, endpoint=False)])
    poses += rng.uniform(-1, 1, poses.shape) * [0.25, 0.25, 0.4]
    out = camera.render_grey(poses)
    best = np.inf
    for _ in range(rounds):
        began = time.perf_counter()
        camera.render_grey(poses, out)
        best = min(best, time.perf_counter() - began)
    return best / cars * 1e6


def main() -> None:
    for name in ("reinvent_base", "reInvent2019_track", "Vegas_track", "AWS_track", "Monaco"):
        times = "  ".join(f"{w}x{h} {microseconds_per_frame(name, w, h):5.1f}" for w, h in SIZES)
        print(f"{name:20s} {times}  us/frame")


if __name__ == "__main__":
    main()
