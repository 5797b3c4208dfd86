"""Draw a track with two paths on it, and measure them: the centre line, and a line that swings from side to side."""

import sys
from pathlib import Path

import numpy as np

from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track

track = load_track("2022_reinvent_champ_ccw")
share = np.linspace(0.0, 1.0, 600)
poses = [track.pose_at_share(float(part)) for part in share]
swing = 0.25 * track.width_mean * np.sin(8.0 * np.pi * share)
weaving = np.array([(p.x - s * np.sin(p.yaw), p.y + s * np.cos(p.yaw)) for p, s in zip(poses, swing, strict=True)])
offset = track.locate(weaving).distance

file = Path(sys.argv[1]) if len(sys.argv) > 1 else None
paths = [PaintedPath(track.centre), PaintedPath(weaving, offset, "distance from the centre (m)")]
draw_track(track, file, paths=paths, number_every=0)
length = np.linalg.norm(np.diff(weaving, axis=0), axis=1).sum()
print(f"{track.title}: centre line {track.length:.2f} m, weaving line {length:.2f} m")
assert track.contains(weaving).all()
