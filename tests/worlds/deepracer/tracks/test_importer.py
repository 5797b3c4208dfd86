"""Route files that make no circuit are refused with the row where it shows."""

import numpy as np
import pytest

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import import_track

ROWS = load_track("reinvent_base").rows


def changed(row, columns, value):
    rows = ROWS.copy()
    rows[row, columns] = value
    return rows


def swapped_rows(a, b, columns):
    rows = ROWS.copy()
    rows[a, columns], rows[b, columns] = ROWS[b, columns], ROWS[a, columns]
    return rows


BAD = {
    "one dimension": (np.zeros(6), "two dimensions"),
    "one row": (ROWS[:1], "1 row"),
    "two columns": (ROWS[:, :2], "2 columns"),
    "text": (np.full((4, 6), "a"), "real numbers"),
    "a missing value": (changed(17, 3, np.nan), "row 17"),
    "millimetres": (ROWS * 10_000, "row 0"),
    "two rows": (ROWS[:2], "2 row(s)"),
    "rows all in one place": (ROWS[[0, 0, 0, 0]], "coincide"),
    "a loop of three rows": (ROWS[[0, 40, 0]], "at least 4 rows"),
    "three rows of 30 cm": (
        np.array([[x, 0, x, 0.15, x, -0.15] for x in (0.0, 0.15, 0.3)]),
        "a centre line of 0.3 m; expected at least 1 m",
    ),
    "a loop that no car gets round": (ROWS * 0.1, "expected at least 2 m"),
    "not closed": (ROWS[:-1], "Append a copy of row 0"),
    "ends that nearly meet": (changed(-1, 0, ROWS[0, 0] + 0.004), "0.004 m from the first"),
    "too narrow": (np.hstack([ROWS[:, :2], ROWS[:, :2] + [0, 0.01], ROWS[:, :2] - [0, 0.01]]), "wide"),
    "centimetres": (ROWS * 100, "row 0 is 7"),
    "a border crossing itself": (swapped_rows(30, 32, slice(4, 6)), "outer border crosses itself between rows"),
    "borders crossing": (changed(50, slice(2, 4), 1.2 * ROWS[50, 4:6] - 0.2 * ROWS[50, 2:4]), "cross outer rows"),
    "two rows that changed places": (swapped_rows(10, 11, slice(0, 6)), "turns back by 180° at row 10"),
    "a section upside down": (np.vstack([ROWS[:40], ROWS[60:39:-1], ROWS[61:]]), "expected rows in driving order"),
    "borders swapped": (ROWS[:, [0, 1, 4, 5, 2, 3]], "Swap columns"),
    "a centre beside the road": (changed(50, slice(0, 2), 2 * ROWS[50, 4:6] - ROWS[50, 2:4]), "not between"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_route_file_is_refused_with_a_letter(tmp_path, case):
    rows, letter = BAD[case]
    np.save(tmp_path / "mine.npy", rows)
    with pytest.raises(TrackError) as refusal:
        import_track(tmp_path / "mine.npy")
    assert letter in str(refusal.value)
    assert "mine.npy" in str(refusal.value)
    assert "expected" in str(refusal.value)


def test_a_pickle_is_never_opened(tmp_path):
    np.save(tmp_path / "mine.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(TrackError, match="can run code"):
        import_track(tmp_path / "mine.npy")


@pytest.mark.parametrize(
    ("content", "letter"),
    [(b"", "empty"), (b"hello, this is no array at all", "no plain .npy|not readable"), (b"\x93NUMPY", "not readable")],
)
def test_what_is_no_array_is_refused(tmp_path, content, letter):
    (tmp_path / "mine.npy").write_bytes(content)
    with pytest.raises(TrackError, match=letter):
        import_track(tmp_path / "mine.npy")


def test_an_archive_and_a_missing_file_are_refused(tmp_path):
    np.savez(tmp_path / "mine.npz", a=ROWS)
    (tmp_path / "mine.npz").rename(tmp_path / "mine.npy")
    with pytest.raises(TrackError, match="archive"):
        import_track(tmp_path / "mine.npy")
    with pytest.raises(TrackError, match="no such file"):
        import_track(tmp_path / "yours.npy")
    with pytest.raises(TrackError):
        import_track(tmp_path)


def test_a_good_file_comes_in_as_it_is(tmp_path):
    np.save(tmp_path / "mine.npy", ROWS)
    track = load_track(tmp_path / "mine.npy")
    assert track.name == "mine"
    assert (track.rows == ROWS).all()
    assert track.hash() == load_track("reinvent_base").hash()
    assert track.field_bounds == pytest.approx((-0.674, -0.710, 8.664, 5.879), abs=0.01)


def test_extra_columns_and_other_number_types_are_welcome(tmp_path):
    np.save(tmp_path / "mine.npy", np.hstack([ROWS, ROWS]).astype(np.float32))
    assert len(load_track(str(tmp_path / "mine.npy")).centre) == 119
