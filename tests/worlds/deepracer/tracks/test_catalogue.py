"""The circuits that come along: names, figures, and how near their curves are to the surveyed rows."""

import json

import numpy as np
import pytest
from tests.reference import DATA

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks import catalogue
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, resolve, summary
from racecraft.worlds.deepracer.tracks.fit import FARTHEST_M, MEAN_M, fit_shape, misses
from racecraft.worlds.deepracer.tracks.importer import check_shape, import_track
from racecraft.worlds.deepracer.tracks.look import TrackLook
from racecraft.worlds.deepracer.tracks.shape_file import rows_from_record, shape_text
from racecraft.worlds.deepracer.tracks.spline import lay_curve, weights
from racecraft.worlds.deepracer.tracks.track import Track

SURVEY = DATA / "tracks"
FIRST_SEVEN = (
    "reinvent_base", "reInvent2019_track", "reInvent2019_wide", "Oval_track", "2022_reinvent_champ_ccw",
    "2024_reinvent_champ_ccw", "Straight_track",
)  # fmt: skip


def test_every_name_is_there_and_every_file_is_used():
    assert len(names()) == 127
    assert set(FIRST_SEVEN) < set(names())
    used = {entry["shape"] for entry in catalogue._index().values()}
    assert used == {path.stem for path in (catalogue.FOLDER / "shapes").glob("*.json")}
    assert len(used) == 120
    size = sum(path.stat().st_size for path in catalogue.FOLDER.rglob("*.json"))
    assert size < 2_000_000


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
        ("reinvent_base", "reinvent_base"),
        ("ReInvent_Base", "reinvent_base"),
        ("re:Invent 2018", "reinvent_base"),
        ("A to Z Speedway", "reInvent2019_wide"),
        ("london loop training", "Virtual_May19_Train_track"),
        ("2024_reinvent_champ", "2024_reinvent_champ_ccw"),
        ("arctic_open", "arctic_open"),
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
        ("reinvent", "reinvent_base"),
        ("reInvent2019", "reInvent2019_wide"),
        ("Re:Inv", "re:Invent 2018"),
        ("vega", "Vegas_track"),
        ("2022_april", "2022_april_pro"),
    ],
)
def test_the_beginning_of_names_is_answered_with_the_shortest_of_them(typed, meant):
    with pytest.raises(TrackError, match=f"Did you mean '{meant}'"):
        load_track(typed)


def test_two_letters_begin_too_many_names_to_mean_one():
    with pytest.raises(TrackError, match=r"racecraft tracks list"):
        load_track("re")


def test_listing_evaluates_no_curve(monkeypatch):
    reader = "racecraft.worlds.deepracer.tracks.shape_file.read_shape"
    monkeypatch.setattr(reader, lambda path: pytest.fail("a curve was read"))
    told = [summary(name).as_dictionary() for name in names()]
    assert len(json.dumps(told)) > 10_000


def test_a_look_comes_back_from_its_record():
    look = TrackLook(road=(1, 2, 3), field_bounds=(0.0, 0.0, 1.0, 2.0), line_side="outside", dash_length=0.0)
    record = json.loads(json.dumps(look.to_record()))
    assert set(record) == {"road", "field_bounds", "line_side", "dash_length"}
    assert TrackLook.from_record(record) == look
    assert TrackLook().to_record() == {}


def test_a_newer_shape_file_is_refused(tmp_path):
    from racecraft.worlds.deepracer.tracks.shape_file import read_shape

    text = (catalogue.FOLDER / "shapes" / "Oval_track.json").read_text()
    (tmp_path / "new.json").write_text(text.replace('"version": 1', '"version": 2'))
    (tmp_path / "torn.json").write_text(text[: len(text) // 2])
    with pytest.raises(TrackError, match="version 2"):
        read_shape(tmp_path / "new.json")
    with pytest.raises(TrackError, match="not readable"):
        read_shape(tmp_path / "torn.json")


def wavy_ring(rows=120, lean=0.0):
    """A loop with two bays; with `lean` its borders stand askew to the centre line."""
    t = np.linspace(0, 2 * np.pi, rows)
    t[-1] = 0.0
    r = 4 + 0.8 * np.cos(3 * t)
    lines = [np.stack([(r + d) * np.cos(t + turn), (r + d) * np.sin(t + turn)], 1) for d, turn in
             ((0, 0), (-0.5, lean), (0.5, -lean))]  # fmt: skip
    return Track.from_rows("wavy", np.hstack(lines))


@pytest.mark.parametrize("lean", [0.0, 0.1])
def test_the_tool_fits_any_loop_within_its_tolerance(lean):
    track = wavy_ring(lean=lean)
    record = json.loads(shape_text(fit_shape(track, "drawn here", "Apache-2.0")))
    missed = misses(record, track)
    assert missed.max() <= FARTHEST_M
    assert missed.mean(axis=0).max() <= MEAN_M
    rows = rows_from_record(record)
    assert (rows[0] == rows[-1]).all()
    assert len(record["centre"]["points"]) < len(rows) / 2


def test_a_straight_needs_hardly_any_points():
    stations = np.linspace(0, 5, 50)
    rows, control = lay_curve(stations, np.stack([stations, 2 * stations], 1), False, 1e-3, 1e-4)
    assert len(rows) <= 6
    assert control[0] == pytest.approx([0, 0])
    assert control[-1] == pytest.approx([5, 10])


@pytest.mark.parametrize("closed", [True, False])
def test_spline_weights_share_out_one_and_agree_with_scipy(closed):
    interpolate = pytest.importorskip("scipy.interpolate")
    knots = np.array([0.0, 1.0, 2.5, 3.0, 4.2] + ([5.5] if closed else [7.0]))
    stations = np.linspace(0, 7, 60)
    ours = weights(knots, stations, 7.0, closed)
    assert ours.sum(axis=1) == pytest.approx(1.0)
    if closed:
        assert ours[0] == pytest.approx(ours[-1])
    else:
        ladder = np.r_[[0.0] * 3, knots, [7.0] * 3]
        theirs = interpolate.BSpline.design_matrix(stations, ladder, 3).toarray()
        assert np.abs(ours - theirs).max() < 1e-14
