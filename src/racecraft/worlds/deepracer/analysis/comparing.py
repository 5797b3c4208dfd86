"""Drive a run's checkpoints over the same starts, and the best from other starts than it was trained on.

Begin with `compare_checkpoints` and `compare_starts`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.analysis.run_advice import TRAIN, typed_command
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.checkpoint_ranking import ranked
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis import tables
from racecraft.worlds.deepracer.analysis.forgetting import SegmentPassRates, StartComparison
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.evaluation.recorded_drives import RecordedDrives, record_drives
from racecraft.worlds.deepracer.players.trained_car import TrainedCar, load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track

STARTS = 24
CHECKPOINTS = 8
SAME_START_M = 0.03
"""Starts that lie closer together are one."""
WIDE_M = 0.10
"""Gaps between starts that are narrower leave nothing in between."""
NEAR_M = 0.05
"""Of few starts each is driven from several times, from so far behind it to so far ahead: one lap tells nothing."""
READ_TICKS = 2_000_000
"""Of a longer log the latest ticks tell where training started."""


def compare_checkpoints(
    path: str | Path, name: str, track: Track | None = None, most: int = CHECKPOINTS, starts: int = STARTS
) -> SegmentPassRates | None:
    """Drive checkpoints of a run from the same starts and count who gets through which segment of the track.

    Args:
        path: The run folder.
        name: What a command calls it.
        track: Where; None: where it was trained.
        most: So many checkpoints, spread over the training; the best and the last are among them.
        starts: Round the lap, evenly.

    Returns:
        None where the run keeps fewer than two checkpoints.
    """
    run = RunFolder.open(path)
    shelf = Checkpoints(run.checkpoints)
    iterations = [entry.iteration for entry in shelf.entries()]
    wanted = spread(iterations, most, {shelf.find("best").iteration, shelf.find("last").iteration})
    if len(wanted) < 2:
        return None
    counts = [_passages(load_trained_car(path, str(one)), track, starts) for one in wanted]
    names = counts[0][0]
    reached, passed = (np.column_stack([one[k] for one in counts]) for k in (1, 2))
    paid = {one.entry.iteration: one.reward for one in ranked(run)}
    typed = typed_command(TRAIN, run.read_job())
    return SegmentPassRates(name, wanted, names, reached, passed, [paid[one] for one in wanted], typed)


def spread(iterations: list[int], most: int, kept: set[int]) -> list[int]:
    """Return so many iterations at most, evenly spread, those to be kept among them.

    >>> spread([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 4, {4, 9})
    [0, 4, 6, 9]
    """
    if len(iterations) <= most:
        return list(iterations)
    places = np.linspace(0, len(iterations) - 1, max(2, most)).round().astype(int)
    chosen = [iterations[k] for k in places]
    for one in kept & set(iterations):  # each takes the place of the nearest that is not itself to be kept
        if one not in chosen:
            nearest = min((c for c in chosen if c not in kept), key=lambda c: abs(c - one), default=None)
            if nearest is not None:
                chosen[chosen.index(nearest)] = one
    return sorted(chosen)


def _passages(car: TrainedCar, track: Track | None, starts: int) -> tuple[list[str], Array, Array]:
    """Return the segments' names, how many cars came to each and how many got through."""
    world = car.world(track or car.trained_on, starts, (np.arange(starts) / starts).tolist())
    drives, segments = record_drives(car.policy, world), find_segments(world.track)
    reached = np.zeros(len(segments.all), int)
    lost = np.zeros(len(segments.all), int)
    failed = set(drives.failed.tolist())
    for row in range(len(drives)):
        at = segments.of(drives.of(row)["arc"] / world.track.length)
        reached[np.unique(at)] += 1
        lost[at[-1]] += row in failed
    return [one.name for one in segments.all], reached, reached - lost


def compare_starts(car: TrainedCar, most: int = STARTS) -> StartComparison | None:
    """Drive a car from starts of its training and from places between them, as often the one as the other.

    Args:
        car: Who drives, on the track it was trained on.
        most: About so many laps of each kind. Of fewer starts there are several laps each, NEAR_M around it, and
            several places in each gap.

    Returns:
        None where the run has no log of its training, or its starts leave no gap worth a name.
    """
    track = car.world(car.trained_on, 1, [0.0]).track
    trained = trained_starts(car.run, track)
    if not len(trained):
        return None
    gaps = np.diff(trained, append=trained[0] + 1.0) * track.length
    wide = np.flatnonzero(gaps >= WIDE_M)
    if not track.closed:
        wide = wide[wide < len(trained) - 1]
    if not len(wide):
        return None
    chosen = wide[np.unique(np.linspace(0, len(wide) - 1, min(len(wide), most)).round().astype(int))]
    each = -(-most // len(chosen))
    near = np.linspace(-NEAR_M, NEAR_M, each) if each > 1 else np.zeros(1)
    starts = (trained[chosen, None] * track.length + near).ravel()
    between = np.concatenate([_inside(trained[k] * track.length, gaps[k], each) for k in chosen])
    own, other = (_laps(car, _shares(arcs, track)) for arcs in (starts, between))
    near_m = NEAR_M if each > 1 else 0.0
    return StartComparison(len(trained), float(gaps.max()), *own[:2], *other[:2], own[2], other[2], near_m)


def _inside(start: float, gap: float, count: int) -> Array:
    """Return so many places evenly inside a gap behind a start, m, or fewer that lie WIDE_M apart."""
    count = max(1, min(count, int(gap / WIDE_M)))
    return start + gap * (np.arange(count) + 0.5) / count


def _shares(arcs: Array, track: Track) -> Array:
    """Return places, m along the centre line, as shares of the lap."""
    shares = arcs / track.length
    return np.asarray(shares % 1.0 if track.closed else np.maximum(shares, 0.0))


def trained_starts(run: RunFolder, track: Track) -> Array:
    """Return the places that a training's log shows episodes to begin at, shares of the lap, rising, (S,)."""
    ticks = tables.load_episodes(run, READ_TICKS)
    if not ticks.height or not {"tick", "x_m", "y_m"} <= set(ticks.columns):
        return np.zeros(0)
    first = ticks.filter(ticks["tick"] == 1)
    if not first.height:
        return np.zeros(0)
    arcs = np.sort((track.locate(first.select("x_m", "y_m").to_numpy()).arc - FRONT_POINT_M) % track.length)
    apart = np.diff(arcs, prepend=arcs[-1] - track.length) > SAME_START_M
    apart[0] |= not apart.any()
    return np.asarray(arcs[apart] / track.length)


def _laps(car: TrainedCar, shares: Array) -> tuple[int, int, float]:
    """Return how many laps were begun, how many ended whole, and their mean progress, per cent."""
    world = car.world(car.trained_on, len(shares), shares.tolist())
    drives: RecordedDrives = record_drives(car.policy, world)
    ends = drives.endings
    progress = np.clip(ends["progress"], 0.0, 100.0)
    return len(shares), int((ends["status"] == race.LAP_COMPLETE).sum()), float(progress.mean())
