"""Lines of a track as an SVG draws them: metres, y downwards. See `svg_path`."""

from __future__ import annotations

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.tracks.track import Track


def svg_view(track: Track, edge_m: float) -> str:
    """Return the view box around a track with so much room on each side."""
    x0, y0, x1, y1 = track.bounds
    return f"{x0 - edge_m:.2f} {-y1 - edge_m:.2f} {x1 - x0 + 2 * edge_m:.2f} {y1 - y0 + 2 * edge_m:.2f}"


def svg_path(points: Array, closed: bool = False) -> str:
    """Return points (N, 2) m as a path, to the millimetre."""
    path = "L".join(f"{x:.3f} {-y:.3f}" for x, y in points.tolist())
    return f"M{path}{'Z' if closed else ''}"
