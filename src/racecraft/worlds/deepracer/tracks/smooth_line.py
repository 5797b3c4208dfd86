"""Smooth a polyline: resampled at equal steps, then blurred along its length. Begin with `smooth_line`."""

from __future__ import annotations

import numpy as np

FINE_M = 0.03
"""Spacing at which a line is smoothed."""
SMOOTHING_M = 0.12
"""Standard deviation of the Gaussian."""


def smooth_line(line: np.ndarray, closed: bool, smoothing: float = SMOOTHING_M) -> np.ndarray:
    """Return a polyline (K, 2) resampled every FINE_M and smoothed; a loop's last row repeats its first.

    Args:
        line: m.
        closed: Whether it is a loop.
        smoothing: Standard deviation of the Gaussian, m.
    """
    arc = running_length(line)
    count = max(16, round(arc[-1] / FINE_M))
    stations = np.linspace(0.0, arc[-1], count + 1)
    points = np.column_stack([np.interp(stations, arc, line[:, k]) for k in (0, 1)])
    if closed:
        smooth = _blur(points[:-1], arc[-1], smoothing)
        return np.concatenate([smooth, smooth[:1]])
    # An open line is mirrored through its ends, which keeps them and their directions.
    before, after = 2 * points[0] - points[:0:-1], 2 * points[-1] - points[-2::-1]
    padded = np.concatenate([before, points, after])
    smooth = _blur(padded, 3 * arc[-1], smoothing)[count : 2 * count + 1]
    return (
        smooth
        + np.linspace(0, 1, count + 1)[:, None] * (points[-1] - smooth[-1])
        + (np.linspace(1, 0, count + 1)[:, None] * (points[0] - smooth[0]))
    )


def running_length(line: np.ndarray) -> np.ndarray:
    """Return (K,) m along a polyline (K, 2) from its first row."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])


def _blur(points: np.ndarray, length: float, smoothing: float) -> np.ndarray:
    waves = np.fft.rfftfreq(len(points), length / len(points))
    damping = np.exp(-2.0 * (np.pi * smoothing * waves) ** 2)
    return np.fft.irfft(np.fft.rfft(points, axis=0) * damping[:, None], len(points), axis=0)
