"""Which failures happened at the same place of the track. Begin with `cluster_failures`."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array

APART_M = 1.0
"""Failures that lie farther apart along the centre line, with none between, are at different places."""
LONGEST_M = 3.0
"""A place that would be longer is parted at its widest gap."""


def cluster_failures(arcs: Array, length: float, closed: bool = True) -> list[Array]:
    """Return which failures are at the same place, the place with most first.

    Args:
        arcs: (F,) where each lies, m along the centre line from the start line.
        length: Of the centre line, m.
        closed: Whether the track is a loop, so that a place may lie across its start line.

    Returns:
        For each place int64 indices into `arcs`, in driving order.

    >>> [place.tolist() for place in cluster_failures(np.array([0.2, 8.0, 9.9, 0.4]), 10.0)]
    [[2, 0, 3], [1]]
    """
    order = np.argsort(arcs, kind="stable")
    if not len(order):
        return []
    gaps = np.diff(arcs[order], append=arcs[order[0]] + length if closed else np.inf)
    widest = int(np.argmax(gaps))
    order, gaps = np.roll(order, -widest - 1), np.roll(gaps, -widest - 1)  # the line begins behind its widest gap
    places = [part for run in _parted(order, gaps[:-1], gaps[:-1] > APART_M) for part in _short(*run)]
    return sorted(places, key=lambda place: -len(place))


def _parted(order: Array, gaps: Array, cuts: Array) -> list[tuple[Array, Array]]:
    """Return the pieces between the cuts, each with the gaps inside it."""
    ends = [*(np.flatnonzero(cuts) + 1).tolist(), len(order)]
    starts = [0, *ends[:-1]]
    return [(order[a:b], gaps[a : b - 1]) for a, b in zip(starts, ends, strict=True)]


def _short(order: Array, gaps: Array) -> list[Array]:
    """Return a place as it is, or parted at its widest gap until no part is longer than LONGEST_M."""
    if gaps.sum() <= LONGEST_M:
        return [order]
    cuts = np.arange(len(gaps)) == np.argmax(gaps)
    return [part for piece in _parted(order, gaps, cuts) for part in _short(*piece)]
