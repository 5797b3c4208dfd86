"""Tracks from drawings: every kind of file, and what cannot be a road."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from racecraft.contract.errors import SettingError, TrackError
from racecraft.worlds.deepracer.tracks.drawings import Drawing, read_drawing
from racecraft.worlds.deepracer.tracks.make import RoadPlan, make_track

RING = [[3 * np.cos(a), 2 * np.sin(a)] for a in np.linspace(0, 2 * np.pi, 60, endpoint=False)]
SVG = '<svg xmlns="http://www.w3.org/2000/svg"><g transform="scale(2)">{}</g></svg>'


def circle_of(drawing):
    """Return the middle and the radii of a drawn circle."""
    middle = (drawing.points.min(axis=0) + drawing.points.max(axis=0)) / 2
    return middle, np.hypot(*(drawing.points - middle).T)


@pytest.mark.parametrize(
    "path",
    [
        "M15 5A10 10 0 0 1 15 25A10 10 0 0 1 15 5z",
        "M 5 15 a 10,10 0 1 1 20 0 a 10,10 0 1 1 -20,0Z",
        "M15 5c5.523 0 10 4.477 10 10s-4.477 10-10 10S5 20.523 5 15 9.477 5 15 5z",
    ],
    ids=["arcs", "large arcs", "curves"],
)
def test_a_circle_of_an_svg_path_is_a_circle_with_its_transform(tmp_path, path):
    file = tmp_path / "circle.svg"
    file.write_text(SVG.format(f'<path d="{path}"/>'))
    drawing = read_drawing(file)
    middle, radii = circle_of(drawing)
    assert drawing.closed
    assert middle == pytest.approx([30, -30], abs=0.2)
    assert radii == pytest.approx(20, rel=0.01)


def test_a_photographed_line_gives_its_outline(tmp_path):
    picture = Image.new("L", (400, 300), 235)
    ImageDraw.Draw(picture).ellipse((100, 50, 300, 250), outline=20, width=9)
    ImageDraw.Draw(picture).ellipse((5, 5, 25, 25), fill=20)
    picture.save(tmp_path / "photo.png")
    middle, radii = circle_of(read_drawing(tmp_path / "photo.png"))
    assert middle == pytest.approx([201, -151], abs=2)
    assert radii == pytest.approx(100, abs=2)


def test_a_gpx_track_is_in_metres(tmp_path):
    points = "".join(f'<trkpt lat="{47 + y / 111194.9}" lon="{8 + x / 75833.9}"/>' for x, y in RING)
    (tmp_path / "ride.gpx").write_text(f"<gpx><trk><trkseg>{points}</trkseg></trk></gpx>")
    drawing = read_drawing(tmp_path / "ride.gpx")
    assert drawing.in_metres
    assert np.ptp(drawing.points, axis=0) == pytest.approx([6, 4], rel=0.01)


def test_a_loop_has_its_length_width_and_direction():
    track = make_track(Drawing(np.array(RING), True, True), RoadPlan(0.6, 12.0), "ring", "ring.svg")
    assert (track.closed, track.direction) == (True, "ccw")
    assert track.length == pytest.approx(12.0, rel=0.01)
    assert track.widths == pytest.approx(0.6, rel=0.02)
    turned = make_track(Drawing(np.array(RING[::-1]), True, True), RoadPlan(0.6, 12.0), "ring", "ring.svg")
    assert turned.direction == "cw"


def test_an_open_line_stays_open():
    track = make_track(Drawing(np.array([[0, 0], [2, 0.5], [4, 0]]), False, True), RoadPlan(), "hall", "hall.csv")
    assert not track.closed
    assert track.length == pytest.approx(4.2, abs=0.2)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (
            [[4 * np.cos(a), 3 * np.sin(2 * a)] for a in np.arange(0, 6.28, 0.2)],
            "crosses itself|not between its borders",
        ),
        ([[0, 0], [3, 0.0], [3, 0.2], [0, 0.2]], "half the width|turns back|crosses"),
        ([[0, 0], [0.1, 0], [0.1, 0.1]], "a line of 0"),
    ],
    ids=["figure of eight", "hairpin", "tiny"],
)
def test_what_is_no_road_is_refused(points, message):
    with pytest.raises(TrackError, match=message):
        make_track(Drawing(np.array(points, float), True, True), RoadPlan(smoothing_m=0.05), "bad", "bad.csv")


def test_a_drawing_without_a_size_asks_for_one():
    with pytest.raises(SettingError, match="--length"):
        make_track(Drawing(np.array(RING), True, False), RoadPlan(), "ring", "ring.svg")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.svg", SVG.format("<rect/>")),
        ("a.svg", SVG.format('<path d="M 1 q"/>')),
        ("a.svg", '<!DOCTYPE s [<!ENTITY a "b">]><svg/>'),
        ("a.svg", "<svg"),
        ("a.gpx", "<gpx/>"),
        ("a.json", '{"points": 3}'),
        ("a.csv", "one,two\n1,2\n"),
        ("a.png", "no picture"),
        ("a.doc", "x"),
    ],
)
def test_a_file_without_a_line_is_named(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(TrackError, match=name):
        read_drawing(tmp_path / name)
