"""The circuits that come along: names, figures, and how near their curves are to the surveyed rows."""

import json

import numpy as np
import pytest
from tests.reference import DATA

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks import catalogue
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, resolve, summary
from racecraft.worlds.deepracer.tracks.importer import check_shape, import_track
from racecraft.worlds.deepracer.tracks.style import TrackStyle

SURVEY = DATA / "tracks"
FARTHEST_M, MEAN_M = 0.005, 0.001
"""How far smoothing may move a point, and the mean of a line."""
FIRST_SEVEN = (
    "reinvent_base", "reInvent2019_track", "reInvent2019_wide", "Oval_track", "2022_reinvent_champ_ccw",
    "2024_reinvent_champ_ccw", "Straight_track",
)  # fmt: skip


def test_every_name_is_there_and_every_file_is_used():
    assert len(names()) == 127
    assert set(FIRST_SEVEN) < set(names())
    used = {entry["shape"] for entry in catalogue._index().values()}
    with np.load(catalogue.FOLDER / "rows.npz") as shapes:
        assert used == set(shapes)
    assert len(used) == 120


def test_waypoints_lie_where_they_were_surveyed():
    for name in names():
        surveyed, ours = import_track(SURVEY / f"{name}.npy"), load_track(name)
        assert ours.rows.shape == surveyed.rows.shape, name
        missed = np.hypot(*np.moveaxis((ours.rows - surveyed.rows).reshape(-1, 3, 2), 2, 0))
        assert missed.max() <= FARTHEST_M, name
        assert missed.mean(axis=0).max() <= MEAN_M, name
        assert ours.length == pytest.approx(surveyed.length, abs=2e-3), name
        assert ours.is_ccw == surveyed.is_ccw, name
        assert ours.closed == surveyed.closed, name


@pytest.mark.parametrize("name", FIRST_SEVEN)
def test_a_shipped_track_is_a_circuit_and_its_summary_is_true(name):
    track, told = load_track(name), summary(name)
    check_shape(track, name)
    assert told.length == pytest.approx(track.length, abs=1e-3)
    assert told.width == pytest.approx(track.width_mean, abs=1e-3)
    assert (told.rows, told.direction, told.title) == (len(track.as_filed().centre), track.direction, track.title)
    assert not track.closed or (track.rows[0] == track.rows[-1]).all()
    x0, y0, x1, y1 = track.field_bounds
    bx0, by0, bx1, by1 = track.bounds
    assert x0 < bx0 < bx1 < x1
    assert y0 < by0 < by1 < y1


def test_the_first_track_has_the_figures_racers_know():
    track = load_track("reinvent_base")
    assert track.length == pytest.approx(17.709159, abs=1e-3)
    assert len(track.centre) == 119
    assert track.centre[0] == pytest.approx((3.05973, 0.68266), abs=5e-3)
    assert track.look.road == (36, 49, 64)
    assert track.look.wall_height == 1.0
    assert load_track("2022_may_pro").look.start_strip_at == pytest.approx(0.13, abs=0.02)


def test_shapes_are_the_same_on_every_machine():
    """Rows are rounded to a micrometre, so this hash stands for one list of decimals."""
    assert load_track("reinvent_base").hash() == "68bcd08b04ee"
    assert load_track("2024_reinvent_champ_ccw").hash() == "72acdd87617f"


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("ReInvent_Base", "reinvent_base"),
        ("re:Invent 2018", "reinvent_base"),
        ("london loop training", "Virtual_May19_Train_track"),
        ("2024_reinvent_champ", "2024_reinvent_champ_ccw"),
        ("Ace Speedway (clockwise)", "2022_april_open_cw"),
    ],
)
def test_racers_words_find_their_track(typed, meant):
    assert resolve(typed) == meant


def test_a_typo_is_answered_with_the_nearest_name():
    with pytest.raises(TrackError, match="Did you mean 'reinvent_base'"):
        load_track("reinvent_bas")
    with pytest.raises(TrackError, match="racecraft tracks"):
        load_track("qqqqqq")


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("reInvent2019", "reInvent2019_wide"),
        ("Re:Inv", "re:Invent 2018"),
    ],
)
def test_the_beginning_of_names_is_answered_with_the_shortest_of_them(typed, meant):
    with pytest.raises(TrackError, match=f"Did you mean '{meant}'"):
        load_track(typed)


def test_a_look_comes_back_from_its_record():
    look = TrackStyle(road=(1, 2, 3), field_bounds=(0.0, 0.0, 1.0, 2.0), line_side="outside", dash_length=0.0)
    record = json.loads(json.dumps(look.to_record()))
    assert set(record) == {"road", "field_bounds", "line_side", "dash_length"}
    assert TrackStyle.from_record(record) == look
    assert TrackStyle().to_record() == {}


def test_a_damaged_file_of_rows_is_refused(tmp_path, monkeypatch):
    data = (catalogue.FOLDER / "rows.npz").read_bytes()
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    for damaged in (data[: len(data) // 2], b"rows", data[:600] + bytes(400) + data[1000:]):
        (tmp_path / "rows.npz").write_bytes(damaged)
        with pytest.raises(TrackError, match=r"rows\.npz: not readable"):
            catalogue._rows_m("2022_april_open")
