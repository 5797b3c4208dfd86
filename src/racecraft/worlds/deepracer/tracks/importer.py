"""Read a route file of AWS form (`.npy`) after looking at every row of it.

The file is a table of K rows and 6 columns, metres: centre x, y, inner border x, y, outer border x, y. A loop's last
row repeats its first. What cannot be a circuit is refused with an error that names the row, counted from 0.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.contract.message import Message
from racecraft.formats.user_file import read_user_file
from racecraft.worlds.deepracer.tracks.catalogue import known_name, load_track
from racecraft.worlds.deepracer.tracks.style import TrackStyle
from racecraft.worlds.deepracer.tracks.track import Track

FORM = "K rows of 6 numbers in metres: centre x, y, inner x, y, outer x, y"
NEARLY_CLOSED_M = 0.05
"""Ends of a line nearer than this, yet not the same, are a loop that somebody forgot to close."""
NARROWEST_M, WIDEST_M = 0.2, 10.0
LARGEST_M = 10_000.0
SHORTEST_LOOP_M, SHORTEST_OPEN_M = 2.0, 1.0
"""A car is 0.33 m long and turns within a circle of some 3 m round; an open track has room for three of them."""
SHARPEST_TURN_DEG = 120.0
"""From one step of the centre line to the next; the catalogue's sharpest is 85."""


def import_track(path: str | Path, name: str = "", look: TrackStyle | None = None) -> Track:
    """Read and check a route file.

    Args:
        path: The `.npy` file.
        name: The track's name; the file's stem when empty.
        look: Colours and lines; the common theme when None.

    Raises:
        TrackError: The file is missing, is no route file, or its rows make no circuit.
    """
    rows = read_rows(path)
    check_rows(rows, path)
    track = Track.from_rows(name or Path(path).stem, rows, look=look or TrackStyle())
    check_shape(track, path)
    return track


def route_file(track: Track) -> bytes:
    """Return a route file of a track: what `import_track` makes the same track of."""
    table = io.BytesIO()
    np.save(table, track.rows, allow_pickle=False)
    return table.getvalue()


def travels(track: Track) -> bool:
    """Tell whether a track must go with what was done on it: the catalogue does not have it."""
    return known_name(track.name) is None or load_track(track.name).hash() != track.hash()


def read_rows(path: str | Path) -> np.ndarray:
    """Return the table in the file as float64, (K, 6); nothing in it is executed.

    Raises:
        TrackError: No file, no `.npy`, a pickle, not two-dimensional, not numbers, too few rows or columns.
    """
    hint = "Save one with numpy.save(path, rows)."
    data = read_user_file(path, TrackError, f"a .npy file of {FORM}")
    try:
        table = np.load(io.BytesIO(data), allow_pickle=False)
    except (OSError, ValueError, EOFError, SyntaxError) as error:
        if "pickle" in str(error).lower() or "object array" in str(error).lower():
            found = Message("no plain .npy table (object arrays and pickles can run code)")
            hint = "Save numbers only: numpy.save(path, rows.astype(float))."
        else:
            found = Message("not readable as .npy ({error})", error=error)
        raise TrackError(path, found, Message("a .npy file of {form}", form=FORM), hint) from error
    if not isinstance(table, np.ndarray):
        raise TrackError(
            path, "an .npz archive of several tables", Message("one .npy table of {form}", form=FORM), hint
        )
    if not (np.issubdtype(table.dtype, np.floating) or np.issubdtype(table.dtype, np.integer)):
        raise TrackError(path, Message("values of type {dtype}", dtype=table.dtype), "real numbers, best float64")
    if table.ndim != 2:
        raise TrackError(
            path, Message("an array of shape {shape}", shape=table.shape), Message("two dimensions, {form}", form=FORM)
        )
    if table.shape[1] < 6:
        raise TrackError(
            path, Message("{shape} columns", shape=table.shape[1]), Message("6 columns, {form}", form=FORM)
        )
    if table.shape[0] < 3:
        raise TrackError(
            path, Message("{shape} row(s)", shape=table.shape[0]), "at least 3 rows for an open track, 4 for a loop"
        )
    return table[:, :6].astype(np.float64)


def check_rows(rows: np.ndarray, path: str | Path) -> None:
    """Refuse values that are not finite or no metres of this world, naming the first such row.

    Raises:
        TrackError: With the row and its value.
    """
    for row in _first(~np.isfinite(rows).all(axis=1)):
        raise TrackError(
            path,
            Message("row {row} holds {text}", row=row, text=_text(rows[row])),
            "finite numbers",
            "Remove or repair the row.",
        )
    for row in _first((np.abs(rows) > LARGEST_M).any(axis=1)):
        raise TrackError(
            path,
            Message("row {row} holds {text}", row=row, text=_text(rows[row])),
            Message("metres within ±{largest_m:g}", largest_m=LARGEST_M),
            "Are these other units?",
        )


def check_shape(track: Track, path: str | Path) -> None:
    """Refuse rows that make no road: too few, unclosed, of absurd width, or with lines that cross.

    Raises:
        TrackError: With the row where it shows.
    """
    rows = len(track.centre)
    if track.length <= 0.0:
        raise TrackError(path, "all centre points coincide", "a centre line of some length")
    if track.closed and rows < 4:
        raise TrackError(
            path,
            Message("a loop of {rows} rows", rows=rows),
            "at least 4 rows for a loop, the first repeated at the end",
        )
    _check_ends(track, path)
    shortest = SHORTEST_LOOP_M if track.closed else SHORTEST_OPEN_M
    if track.length < shortest:
        raise TrackError(
            path,
            Message("a centre line of {length:.3g} m", length=track.length),
            Message("at least {shortest:g} m, on which a car of 0.33 m can drive", shortest=shortest),
            "Are the numbers metres?",
        )
    _check_widths(track, path)
    _check_order(track, path)
    for label, line in (("centre line", track.centre), ("inner border", track.inner), ("outer border", track.outer)):
        if (crossing := _first_crossing(line, line, track.closed)) is not None:
            a, b = crossing
            raise TrackError(
                path,
                Message(
                    "the {label} crosses itself between rows {a}-{a_2} and {b}-{b_2}",
                    label=label,
                    a=a,
                    a_2=a + 1,
                    b=b,
                    b_2=b + 1,
                ),
                "lines that never cross",
            )
    if (crossing := _first_crossing(track.inner, track.outer, None)) is not None:
        a, b = crossing
        raise TrackError(
            path,
            Message("inner rows {a}-{a_2} cross outer rows {b}-{b_2}", a=a, a_2=a + 1, b=b, b_2=b + 1),
            "an inner and an outer border that never meet",
        )
    if track.closed and abs(_area(track.inner)) >= abs(_area(track.outer)):
        raise TrackError(
            path,
            Message(
                "the inner border encloses {area:.2f} m², the outer {area_2:.2f} m²",
                area=abs(_area(track.inner)),
                area_2=abs(_area(track.outer)),
            ),
            "an outer border around the inner one",
            "Swap columns 2-3 with 4-5.",
        )


def _check_ends(track: Track, path: str | Path) -> None:
    if track.closed:
        return
    gap = float(np.hypot(*(track.centre[-1] - track.centre[0])))
    step = float(np.median(np.diff(track.arc)))
    if gap <= max(NEARLY_CLOSED_M, 3 * step) and track.length > 4 * gap and len(track.centre) > 3:
        raise TrackError(
            path,
            Message("the last row ends {gap:.3f} m from the first", gap=gap),
            "a loop whose last row repeats the first exactly, or an open track with its ends apart",
            "Append a copy of row 0: numpy.vstack([rows, rows[:1]]).",
        )


def _check_order(track: Track, path: str | Path) -> None:
    """Refuse a centre line that turns back on itself: two rows have changed places, or a section is upside down."""
    steps = np.diff(track.centre, axis=0)
    following = np.roll(steps, -1, axis=0) if track.closed else steps[1:]
    before = steps[: len(following)]
    across, along = _cross(before, following), (before * following).sum(axis=1)
    turns = np.degrees(np.abs(np.arctan2(across, along)))
    for step in _first(turns > SHARPEST_TURN_DEG):
        raise TrackError(
            path,
            Message(
                "the centre line turns back by {turns:.0f}° at row {step}",
                turns=turns[step],
                step=(step + 1) % len(steps),
            ),
            "rows in driving order",
            "Put the rows in the order in which a car passes them.",
        )


def _check_widths(track: Track, path: str | Path) -> None:
    widths = track.widths
    for row in _first((widths < NARROWEST_M) | (widths > WIDEST_M)):
        raise TrackError(
            path,
            Message("row {row} is {widths:.3f} m wide", row=row, widths=widths[row]),
            Message("a road {narrowest_m:g} to {widest_m:g} m wide", narrowest_m=NARROWEST_M, widest_m=WIDEST_M),
            "Widths are metres between the border points nearest to a waypoint.",
        )
    beside = track.locate(track.centre)
    to_borders = np.hypot(*(beside.inner_point - track.centre).T) + np.hypot(*(beside.outer_point - track.centre).T)
    for row in _first(to_borders > 1.5 * widths + 0.05):
        raise TrackError(
            path,
            Message("row {row}: the centre point is not between its borders", row=row),
            "inner, centre and outer side by side",
        )


def _first_crossing(a: np.ndarray, b: np.ndarray, closed: bool | None) -> tuple[int, int] | None:
    """Return the first pair of steps (row in a, row in b) that cross; with a is b, neighbours do not count."""
    p, r = a[:-1, None], (a[1:] - a[:-1])[:, None]
    q, s = b[None, :-1], (b[1:] - b[:-1])[None]
    across = _cross(r, s)
    with np.errstate(divide="ignore", invalid="ignore"):
        t, u = _cross(q - p, s) / across, _cross(q - p, r) / across
    meets = (across != 0) & (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
    if a is b:
        index = np.arange(len(a) - 1)
        apart = np.abs(index[:, None] - index[None])
        near = apart <= 1
        if closed:
            near |= apart == len(a) - 2
        meets &= ~near
    hits = np.argwhere(meets)
    return None if len(hits) == 0 else (int(hits[0, 0]), int(hits[0, 1]))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2)


def _first(bad: np.ndarray) -> list[int]:
    """Return the first bad row in a list, or an empty list."""
    return [int(row) for row in np.flatnonzero(bad)[:1]]


def _text(row: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in row) + ")"
