"""Which circuit a log was driven on, and where its ticks lie along it. Begin with `find_track` and `on_track`.

Places along the lap come from x and y, never from the waypoint numbers in the log: those count the rows of the file
that the simulator had, which need not be the rows that are here, nor run the same way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from racecraft.analysis.plot import PlotError
from racecraft.contract.errors import TrackError
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.analysis.logs.plot import require
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, summary
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.logs import Logs

SAMPLE = 1500
SAME_LENGTH_M = 0.1
"""How much the track length in a log may differ from the catalogue's, whose curves are smooth."""
MAX_LENGTH_SHARE, MAX_MISFIT = 0.02, 0.6
"""A named track may differ from the log's length by so large a share, as waypoint files do, and ticks may lie so many
widths from its centre line on average: a car on the road is within half of one."""


def find_track(ticks: pl.DataFrame | pl.LazyFrame, world: str | None = None) -> Track:
    """Return the circuit of a log, turned the way it was driven, its waypoints counted as the log counts them.

    Args:
        ticks: The ticks.
        world: Its name if the files beside the log say it, or a path; None: by length and by where the car drove.

    Raises:
        PlotError: No circuit of the catalogue fits.
        TrackError: There is no circuit of the name, or the log was driven on another.
    """
    frame = require(ticks, "x_m", "y_m", "track_length_m")
    length = float(frame["track_length_m"].drop_nulls().median() or 0.0)  # type: ignore[arg-type]
    sample = frame.gather_every(max(1, frame.height // SAMPLE))
    if world is not None:
        return _counted(_turned(_checked(load_track(world), world, sample, length), sample), sample)
    near = [name for name in names() if abs(summary(name).length - length) < SAME_LENGTH_M]
    fits = sorted(((_misfit(track, sample), track.name, track) for track in map(load_track, near)), key=lambda f: f[:2])
    if not fits or fits[0][0] > 2.0 * fits[0][2].width_mean:
        raise PlotError(
            "No track of the catalogue is {length:.3f} m long and lies where the car drove; expected its name. "
            "Name it with --track, or bring its waypoint file (.npy).",
            length=length,
        )
    return _counted(_turned(fits[0][2], sample), sample)


def track_or_none(ticks: pl.DataFrame | pl.LazyFrame, world: str | None = None) -> Track | None:
    """Return the circuit, or None where none fits."""
    try:
        return find_track(ticks, world)
    except TrackError:
        return track_or_none(ticks) if world is not None else None
    except PlotError:
        return None


def is_of(ticks: pl.DataFrame, track: Track) -> bool:
    """Tell whether ticks were driven on a circuit, the same way round."""
    length = float(ticks["track_length_m"].drop_nulls().median() or 0.0)  # type: ignore[arg-type]
    sample = ticks.gather_every(max(1, ticks.height // SAMPLE))
    try:
        return _turned(_checked(track, track.name, sample, length), sample) is track
    except TrackError:
        return False


def circuit_of(logs: Logs, track: str | None = None) -> Track:
    """Return the circuit of a log: the one that is named; else the one that its files name, or that fits.

    Raises:
        TrackError: There is no track of this name, or it is another than the log's.
        PlotError: None fits.
    """
    ticks = logs.require_ticks()
    if track is not None:
        return find_track(ticks, track)
    return track_or_none(ticks, logs.about.get("world")) or find_track(ticks)


def _checked(track: Track, world: str, sample: pl.DataFrame, length: float) -> Track:
    """Return a circuit on which a log can have been driven.

    Raises:
        TrackError: The log's is of another length, or its ticks lie beside this one.
    """
    apart = _misfit(track, sample)
    if (length and abs(track.length - length) > MAX_LENGTH_SHARE * length) or apart > MAX_MISFIT * track.width_mean:
        raise TrackError(
            world,
            Message("a track of {length:.2f} m, from whose centre line the log's ticks are {apart:.2f} m on average",
                    length=track.length, apart=apart),
            Message("the track that was driven, of {length:.2f} m", length=length),
            "Leave the name out: the track is found by its length and by where the car drove.",
        )  # fmt: skip
    return track


def _misfit(track: Track, sample: pl.DataFrame) -> float:
    """Return how far the car was from the centre line, m on average, and a little for waypoints that differ."""
    found = track.locate(sample.select("x_m", "y_m").to_numpy())
    off = float(np.minimum(found.distance, 5.0).mean())
    return off + 0.05 * (1.0 - max(_agreement(track, sample), _agreement(track.reversed(), sample)))


def _turned(track: Track, sample: pl.DataFrame) -> Track:
    """Return the circuit the way it was driven: the way round in which cars come forward."""
    arc = track.locate(sample.select("x_m", "y_m").to_numpy()).arc
    return track if _forward(track, sample, arc) >= 0.5 else track.reversed()


def _counted(track: Track, sample: pl.DataFrame) -> Track:
    """Return the circuit with all rows of its route file, as AWS's logs count them, or each place once if the log does.

    In every other file of the catalogue one row repeats the one before; from there on the two differ by one.
    """
    if not track.repeated_rows:
        return track
    filed = track.as_filed()
    return filed if _agreement(filed, sample, 0) >= _agreement(track, sample, 0) else track


def _forward(track: Track, sample: pl.DataFrame, arc: np.ndarray) -> float:
    """Return the share of ticks that look along the circuit."""
    yaw = sample["yaw_rad"].to_numpy()
    row = np.searchsorted(track.arc, arc, side="right").clip(1, len(track.arc) - 1)
    along = track.centre[row] - track.centre[row - 1]
    return float((along[:, 0] * np.cos(yaw) + along[:, 1] * np.sin(yaw) > 0).mean())


def _agreement(track: Track, sample: pl.DataFrame, apart: int = 1) -> float:
    """Return the share of ticks whose recorded waypoint is the circuit's own, or so many rows apart."""
    if "closest_waypoint" not in sample.columns or sample["closest_waypoint"].null_count():
        return 0.0
    found = track.locate(sample.select("x_m", "y_m").to_numpy()).nearer_waypoint
    return float((np.abs(found - sample["closest_waypoint"].to_numpy()) <= apart).mean())


def on_track(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> pl.DataFrame:
    """Add where each tick lies.

    Added: `lap_share` (0 to 1 along the centre line from the start), `waypoint` (nearest row of *this* track),
    `offset_m` (from the centre line, left positive).
    """
    import polars as pl

    frame = require(ticks, "x_m", "y_m")
    if "lap_share" in frame.columns and "waypoint" in frame.columns:
        return frame
    found = track.locate(frame.select("x_m", "y_m").to_numpy())
    return frame.with_columns(
        pl.Series("lap_share", found.arc / track.length),
        pl.Series("waypoint", found.nearer_waypoint.astype(np.int32)),
        pl.Series("offset_m", np.where(found.is_left, found.distance, -found.distance)),
    )
