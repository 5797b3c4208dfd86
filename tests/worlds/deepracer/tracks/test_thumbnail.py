"""Small pictures of circuits: sound SVG, small, to scale."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.thumbnail import HEIGHT, WIDTH, thumbnail_svg


@pytest.mark.parametrize("name", ["reinvent_base", "Straight_track", "2022_april_pro_cw", "Monaco"])
def test_a_picture_is_sound_small_and_inside_its_frame(name):
    text = thumbnail_svg(load_track(name))
    root = ElementTree.fromstring(text)
    assert root.attrib["viewBox"] == f"0 0 {WIDTH} {HEIGHT}"
    assert len(text) < 12_000
    road = root.findall("{http://www.w3.org/2000/svg}path")[0].attrib["d"]
    start = [float(number) for number in re.findall(r"M([\d.]+) ([\d.]+)", road)[0]]
    assert 0 < start[0] < WIDTH
    assert 0 < start[1] < HEIGHT


def corners(path):
    """The points of an SVG path of relative steps."""
    begin, steps = re.match(r"M([^l]+)l([^z]*)z?", path).groups()
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", steps)]
    return np.cumsum([[float(part) for part in begin.split()], *np.reshape(numbers, (-1, 2))], axis=0)


def test_a_circuit_is_drawn_to_scale():
    """Road of reinvent_base: 5.4 m high; the picture is as tall as its frame allows, or as wide."""
    track = load_track("reinvent_base")
    lines = ElementTree.fromstring(thumbnail_svg(track)).findall("{http://www.w3.org/2000/svg}path")
    drawn = corners(lines[2].attrib["d"])
    ratio = np.ptp(drawn[:, 0]) / np.ptp(drawn[:, 1])
    assert ratio == pytest.approx(np.ptp(track.outer[:, 0]) / np.ptp(track.outer[:, 1]), rel=0.01)
