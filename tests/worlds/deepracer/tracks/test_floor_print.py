"""The scale of a printed track, measured in the PDF itself."""

import re
import zlib

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.tracks import floor_print
from racecraft.worlds.deepracer.tracks.drawings import Drawing
from racecraft.worlds.deepracer.tracks.floor_print import BAR_MM, PAPERS_MM, print_floor, tape_of
from racecraft.worlds.deepracer.tracks.make import RoadPlan, make_track

MM = 72 / 25.4
LINE = re.compile(rb"(-?[\d.]+) (-?[\d.]+) m\s+(-?[\d.]+) (-?[\d.]+) l\s+S")


@pytest.fixture(scope="module")
def ring():
    angles = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    points = np.column_stack([np.cos(angles), 0.8 * np.sin(angles)])
    return make_track(Drawing(points, True, True), RoadPlan(0.3, 3.0, 0.05), "ring", "ring.json")


@pytest.fixture(scope="module")
def pages(ring, tmp_path_factory):
    """The printed ring, and each page's straight strokes, (S, 4) mm."""
    printed = print_floor(ring, tmp_path_factory.mktemp("print") / "ring.pdf", "A3")
    data = printed.file.read_bytes()
    boxes = re.findall(rb"/MediaBox \[ ([\d. ]+) \]", data)
    streams = []
    for stream in re.finditer(rb"stream\r?\n(.*?)endstream", data, re.DOTALL):
        try:
            text = zlib.decompress(stream[1])
        except zlib.error:
            continue
        if strokes := LINE.findall(text):
            streams.append(np.array(strokes, float) / MM)
    return printed, boxes, streams


def lengths(strokes):
    return np.hypot(strokes[:, 2] - strokes[:, 0], strokes[:, 3] - strokes[:, 1])


def test_paper_and_bar_have_their_true_size(pages):
    printed, boxes, streams = pages
    assert len(boxes) == printed.pages + 1 == len(streams)
    for box in boxes:
        assert np.array(box.split(), float)[2:] / MM == pytest.approx(PAPERS_MM["A3"], abs=0.01)
    for strokes in streams:
        assert np.isclose(lengths(strokes), BAR_MM, atol=0.01).any()


def test_the_road_is_printed_one_to_one(ring, pages):
    """Pieces of the borders are printed in their true length; those that a page cuts are shorter."""
    _, _, (_, *floor) = pages
    printed = np.unique(np.round(np.concatenate([lengths(strokes) for strokes in floor]), 2))
    for border in (ring.inner, ring.outer):
        true = 1000 * np.hypot(*np.diff(border, axis=0).T)
        is_whole = np.array([np.abs(printed - one).min() < 0.05 for one in true])  # mm, of pieces 100 to 200 mm long
        assert is_whole.mean() > 0.6
        wrong = np.array([np.abs(printed - 1.01 * one).min() < 0.05 for one in true])
        assert wrong.mean() < 0.3  # a scale that is wrong by 1 % is seen


def test_neighbouring_pages_meet(pages):
    """The crosses of a page are 10 mm inside its printed edge, so that two pages overlap by 20 mm."""
    _, _, (_, *floor) = pages
    crosses = [strokes[np.isclose(lengths(strokes), 10.0, atol=0.01)] for strokes in floor]
    for cross in crosses:
        middles = np.unique(np.round((cross[:, :2] + cross[:, 2:]) / 2, 1), axis=0)
        assert {tuple(one) for one in middles} >= {(20.0, 20.0), (277.0, 400.0)}


def test_the_bill_of_tape_adds_up(ring):
    tape = tape_of(ring)
    assert tape.borders_m == pytest.approx(6.0, rel=0.02)
    assert tape.centre_m == pytest.approx(1.5, rel=0.01)
    assert tape.start_m == pytest.approx(0.3, rel=0.01)


def test_too_many_pages_and_other_files_are_refused(ring, tmp_path, monkeypatch):
    monkeypatch.setattr(floor_print, "MAX_PAGES", 5)
    with pytest.raises(SettingError, match="larger paper"):
        print_floor(ring, tmp_path / "a.pdf")
    with pytest.raises(SettingError, match=r"\.pdf"):
        print_floor(ring, tmp_path / "a.png")
