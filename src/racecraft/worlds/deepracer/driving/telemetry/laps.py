"""Full laps of a log, each as traces along the lap. Begin with `find_laps`.

A trace has a value for each of N equal pieces of the centre line, counted from the start line. A lap that began
elsewhere is turned round to it: piece k of every lap is the same place. The seconds of a lap's pieces add up to its
lap time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.episodes import STATUSES
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

PIECE_M = 0.05
MIN_PIECES, MAX_PIECES = 100, 800
WINDOW = 7
"""Driven speed is the mean over so many pieces, an odd number."""
REST_M = 2.0
"""So far from a standing start the car is still gathering speed."""
SETTLED = 3
"""In so many ticks of a lap the simulator may still be putting the car down."""
MIN_SLIDING_MPS = 0.3
"""Below it the direction of travel is noise, and there is no slide."""
FULL = 1.0 - 1e-9
TRACES = ("seconds", "metres", "steering_rad", "throttle_mps", "offset_m")
ORIGIN = ("round", "phase", "stream", "worker")
"""What a lap cannot reach over."""
NEEDED = (*ORIGIN, "iteration", "episode", "unique_episode", "time_s", "x_m", "y_m", "yaw_rad", "steering_rad",
          "speed_mps", "action", "progress_share", "status")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Laps:
    """L full laps of one track."""

    track: Track
    """As it was driven."""
    about: pl.DataFrame
    """A row a lap: round, phase, stream, worker, iteration, episode, unique_episode; `first_row` and `last_row` among
    the ticks; `seconds`; `begin_share`, where on the lap it began; `from_rest`; `resets`, how often the car left the
    road and was set back; `actions`, a list of the numbers that it chose tick by tick; `mean_reward` of a tick, null
    where the log has none; `max_slide_rad`, the largest angle between where the car points and where it goes, 0 or
    more."""
    seconds: Array
    """(L, N) s spent on each piece."""
    metres: Array
    """(L, N) m driven on it, along the car's own path."""
    steering_rad: Array
    """(L, N) commanded wheel angle in the middle of the piece, left positive."""
    throttle_mps: Array
    """(L, N) commanded speed there."""
    offset_m: Array
    """(L, N) from the centre line, left positive."""
    tick: Array
    """(L, N) row of the tick that holds in the middle of the piece."""
    ticks: pl.DataFrame
    """The log's, whole laps or not; rows count among them."""
    titles: Mapping[int, str]
    """What rounds are called: the title of a race. Others have their number."""

    def __len__(self) -> int:
        return self.about.height

    @property
    def episodes(self) -> int:
        """Episodes of the log, whole laps or not."""
        return int(self.ticks["unique_episode"].n_unique())

    @property
    def pieces(self) -> int:
        """N."""
        return int(self.seconds.shape[1])

    @property
    def shares(self) -> Array:
        """(N,) the middle of each piece, a share of the lap."""
        return (np.arange(self.pieces) + 0.5) / self.pieces

    @property
    def lap_seconds(self) -> Array:
        """(L,) s."""
        return self.about["seconds"].to_numpy()

    @property
    def speed_mps(self) -> Array:
        """(L, N) driven speed, along the car's own path, as `driven_speed` has it."""
        return driven_speed(self.metres, self.seconds, self.track.closed)

    @property
    def gathering(self) -> Array:
        """(L, N) bool: the car stood at the beginning of the lap and is still gathering speed there."""
        begin = self.about["begin_share"].to_numpy()[:, None]
        ahead = (self.shares - begin) % 1.0 * self.track.length
        near = (ahead < REST_M) | (ahead > self.track.length - self.track.length / self.pieces)
        return np.asarray(near & self.about["from_rest"].to_numpy()[:, None])

    def take(self, rows: Array) -> Laps:
        """Return some of the laps, in the order of `rows` (K,)."""
        return replace(
            self, about=self.about[rows.tolist()], **{name: getattr(self, name)[rows] for name in (*TRACES, "tick")}
        )


def find_laps(ticks: pl.DataFrame, track: Track) -> Laps:
    """Return the full laps of a log, in its order.

    A lap ends where the log says so, or where its progress is whole. It begins at its episode's first tick, or, for a
    car that drives on, where the lap before it ended.

    Args:
        ticks: The table of `logs.read`.
        track: As it was driven.
    """
    columns = {name: ticks[name].to_numpy() for name in NEEDED if name not in ("phase", "stream", "status", "action")}
    first, last, from_rest = _spans(ticks, columns)
    traces, begin_share = trace_laps(columns, first, last, track)
    about = ticks[last.tolist()].select(*ORIGIN, "iteration", "episode", "unique_episode").with_columns(
        **_series(first, last, columns, from_rest),
        actions=_actions(ticks, first, last),
        begin_share=_polars().Series(begin_share),
        resets=_polars().Series(_resets(ticks, first, last)),
        mean_reward=_mean_reward(ticks, first, last),
        max_slide_rad=_polars().Series(_max_slide(columns, first, last)),
    )  # fmt: skip
    return Laps(track, about, ticks=ticks, titles={}, **traces)


def trace_laps(columns: Mapping[str, Array], first: Array, last: Array, track: Track) -> tuple[dict[str, Array], Array]:
    """Return the traces of laps and `tick` (see `Laps`) by name, and where each lap began, a share of it (L,).

    Args:
        columns: Ticks, (T,) each: time_s, x_m and y_m (the car's front point), steering_rad, speed_mps (commanded).
        first: (L,) the row with which each lap begins.
        last: (L,) the row with which it ends.
        track: As it was driven.
    """
    pieces = int(np.clip(round(track.length / PIECE_M), MIN_PIECES, MAX_PIECES))
    if not len(first):
        return {name: np.zeros((0, pieces)) for name in (*TRACES, "tick")}, np.zeros(0)
    rows = _rows_of(first, last)
    place = track.locate(np.column_stack([columns["x_m"][rows], columns["y_m"][rows]]))
    ends = np.cumsum(last - first + 1)
    traces = _resample(columns, rows, ends, place, track.length, pieces)
    return traces, place.arc[ends - (last - first + 1)] / track.length % 1.0


def driven_speed(metres: Array, seconds: Array, closed: bool) -> Array:
    """Return speeds (…, N) m/s: metres over seconds, both summed over WINDOW pieces around each, as ticks jitter.

    nan where no time was spent there. On a closed track the window reaches over the start line.
    """

    def summed(values: Array) -> Array:
        padding = [(0, 0)] * (values.ndim - 1) + [(WINDOW // 2 + 1, WINDOW // 2)]
        total = np.cumsum(np.pad(values, padding, mode="wrap" if closed else "edge"), axis=-1)
        return np.asarray(total[..., WINDOW:] - total[..., :-WINDOW])

    driven, spent = summed(metres), summed(seconds)
    moved = spent > 1e-9
    return np.where(moved, driven / np.where(moved, spent, 1.0), np.nan)


def _polars() -> Any:
    import polars as pl

    return pl


def _series(first: Array, last: Array, columns: dict[str, Array], from_rest: Array) -> dict[str, Any]:
    series = _polars().Series
    seconds = columns["time_s"][last] - columns["time_s"][first]
    return {
        "first_row": series(first),
        "last_row": series(last),
        "seconds": series(seconds),
        "from_rest": series(from_rest),
    }


def _spans(ticks: pl.DataFrame, columns: dict[str, Array]) -> tuple[Array, Array, Array]:
    """Return first and last row of every full lap, (L,), and whether it began at rest."""
    count = ticks.height
    codes = ticks["status"].to_physical().fill_null(len(STATUSES)).to_numpy().astype(np.int64)
    new = _changes(columns["unique_episode"])
    episode_end = np.roll(new, -1)
    complete = codes == STATUSES.index("lap_complete")
    untold = (codes == len(STATUSES)) | (codes == STATUSES.index("in_progress"))
    complete |= episode_end & untold & (columns["progress_share"] >= FULL)
    complete[:-1] &= ~(complete[1:] & ~new[1:])  # a lap that is told in several ticks ends in the last of them
    last = np.flatnonzero(complete)
    elsewhere = np.zeros(count, np.bool_)
    if count:
        spans = ticks.select(_polars().any_horizontal(
            *(_polars().col(name).ne_missing(_polars().col(name).shift()) for name in ORIGIN)
        )).to_series().to_numpy()  # fmt: skip
        training = (ticks["phase"] == "training").to_numpy()
        elsewhere = spans | (codes == STATUSES.index("prepare")) | (new & training)
        elsewhere[0] = True
    starts = np.flatnonzero(new)
    begin = starts[np.searchsorted(starts, last, side="right") - 1]
    before = np.concatenate([[-1], last[:-1]]) if len(last) else last
    goes_on = before >= begin
    rolling = ~goes_on & ~elsewhere[begin] & (before == begin - 1)
    first = np.where(goes_on | rolling, before, begin)
    return first, last, ~(goes_on | rolling)


def _rows_of(first: Array, last: Array) -> Array:
    """Return the rows of all laps, one lap after the other; a row that two laps share stands twice."""
    lengths = last - first + 1
    ends = np.cumsum(lengths)
    return np.asarray(np.arange(ends[-1] if len(ends) else 0) + np.repeat(first - (ends - lengths), lengths))


def _resample(
    columns: Mapping[str, Array], rows: Array, ends: Array, place: Any, length: float, pieces: int
) -> dict[str, Array]:
    """Return the traces of all laps at once: laps stand one behind the other on a line, far enough apart."""
    lap = np.searchsorted(ends, np.arange(len(rows)), side="right")
    begins = np.concatenate([[0], ends[:-1]]).astype(np.int64)
    driven = _along(place.arc, lap, begins, length)
    path = _path(columns["x_m"][rows], columns["y_m"][rows], lap)
    time = columns["time_s"][rows] - columns["time_s"][rows[begins]][lap]
    step, apart = length / pieces, 4.0 * length
    start = place.arc[begins]
    first_piece = np.floor(start / step).astype(np.int64)
    edges = (first_piece[:, None] + 1 + np.arange(pieces)) * step - start[:, None]
    edges = np.clip(edges, 0.0, driven[ends - 1][:, None]) + np.arange(len(ends))[:, None] * apart
    at = driven + lap * apart
    order = (first_piece[:, None] + 1 + np.arange(pieces)) % pieces

    def spent(total: Array) -> Array:
        crossed = np.interp(edges.ravel(), at, total).reshape(edges.shape)
        pieces_of = np.diff(crossed, axis=1, append=(total[ends - 1][:, None] + crossed[:, :1]))
        return _turned(pieces_of, order)

    middle = np.clip(edges + 0.5 * step, None, driven[ends - 1][:, None] + np.arange(len(ends))[:, None] * apart)
    row = np.minimum(np.searchsorted(at, middle.ravel(), side="left"), len(at) - 1)
    offset = np.where(place.is_left, place.distance, -place.distance)
    held = {"steering_rad": columns["steering_rad"][rows], "throttle_mps": columns["speed_mps"][rows]}
    traces = {name: _turned(values[row].reshape(edges.shape), order) for name, values in held.items()}
    traces["offset_m"] = _turned(np.interp(middle.ravel(), at, offset).reshape(edges.shape), order)
    tick = _turned(rows[row].reshape(edges.shape), order)
    return traces | {"seconds": spent(time), "metres": spent(path), "tick": tick}


def _along(arc: Array, lap: Array, begins: Array, length: float) -> Array:
    """Return how far each tick is along the lap that it belongs to, m; never less than the tick before."""
    step = np.diff(arc, prepend=arc[:1])
    step = (step + 0.5 * length) % length - 0.5 * length
    step[begins] = 0.0
    total = np.cumsum(step)
    total -= total[begins][lap]
    lifted = total + lap * 4.0 * length
    return np.asarray(np.maximum.accumulate(lifted) - lap * 4.0 * length)


def _path(x: Array, y: Array, lap: Array) -> Array:
    """Return how far the car has driven since its lap began, m."""
    step = np.hypot(np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1]))
    step[_changes(lap)] = 0.0
    total = np.cumsum(step)
    return np.asarray(total - total[np.flatnonzero(_changes(lap))][lap])


def _turned(values: Array, order: Array) -> Array:
    """Put values that stand in driving order in the order of the track's pieces."""
    out = np.empty_like(values)
    np.put_along_axis(out, order, values, axis=1)
    return out


def _resets(ticks: pl.DataFrame, first: Array, last: Array) -> Array:
    """Return how often the car left the road or crashed within each lap."""
    bad = ticks["status"].cast(_polars().String).is_in(["off_track", "crashed", "immobilized", "reversed"])
    happened = bad.fill_null(False).to_numpy()
    is_start = happened & ~np.concatenate([[False], happened[:-1]])
    count = np.concatenate([[0], np.cumsum(is_start)])
    return np.asarray(count[last + 1] - count[first + 1])


def _actions(ticks: pl.DataFrame, first: Array, last: Array) -> pl.Series:
    """Return the numbers of the actions that each lap chose, tick by tick."""
    numbers = ticks["action"].fill_null(-1)
    rows = zip(first.tolist(), last.tolist(), strict=True)
    return _polars().Series([numbers[begin + 1 : end + 1] for begin, end in rows], dtype=_polars().List(numbers.dtype))


def _mean_reward(ticks: pl.DataFrame, first: Array, last: Array) -> pl.Series:
    """Return what a tick of each lap paid on average."""
    if "reward" not in ticks.columns:
        return _polars().Series([None] * len(first), dtype=_polars().Float64)
    paid = np.concatenate([[0.0], np.cumsum(ticks["reward"].fill_null(0.0).to_numpy())])
    mean = (paid[last + 1] - paid[first + 1]) / np.maximum(last - first, 1)
    return _polars().Series(mean)


def _max_slide(columns: Mapping[str, Array], first: Array, last: Array) -> Array:
    """Return the largest slide of each lap, rad, 0 or more; of laps that began at rest without their first ticks."""
    dx, dy, dt = (np.diff(columns[name], prepend=columns[name][:1]) for name in ("x_m", "y_m", "time_s"))
    slide = np.abs((np.arctan2(dy, dx) - columns["yaw_rad"] + np.pi) % (2.0 * np.pi) - np.pi)
    slide[np.hypot(dx, dy) <= MIN_SLIDING_MPS * dt] = 0.0
    return np.array([slide[begin + SETTLED : end + 1].max(initial=0.0) for begin, end in zip(first, last, strict=True)])


def _changes(values: Array) -> Array:
    changes = np.ones(len(values), np.bool_)
    np.not_equal(values[1:], values[:-1], out=changes[1:])
    return changes
