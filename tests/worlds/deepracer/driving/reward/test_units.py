"""Slips of unit are read from the text, and what fits is left alone."""

import ast

import pytest

from racecraft.worlds.deepracer.driving.reward.units import unit_slips
from racecraft.worlds.deepracer.files.reward_samples import read_sample, sample_names

SLIPS = {
    "d = math.atan2(dy, dx) - params['heading']": "mixes degrees and radians",
    "d = math.atan2(dy, dx)\n    off = abs(d - h)": "mixes degrees and radians",
    "pull = math.cos(params['heading'])": "takes radians and is given degrees",
    "d = math.radians(math.atan2(dy, dx))": "takes degrees and is given radians",
    "calm = abs(params['steering_angle']) < 0.26": "15 degrees in radians",
    "late = params['progress'] > 0.9": "holds from 0.9 % of the lap on",
    "fast = params['speed'] > 20": "always the same",
}
FITTING = [
    "d = math.degrees(math.atan2(dy, dx)) - h",
    "d = math.atan2(dy, dx) - h * math.pi / 180",
    "d = np.rad2deg(np.arctan2(dy, dx)) - h",
    "calm = abs(params['steering_angle']) < 15",
    "done = params['progress'] == 100",
    "share = params['distance_from_center'] / params['track_width'] < 0.1",
    "fast = params['speed'] / 4.0 > 0.5",
    "h = math.radians(h)\n    d = math.atan2(dy, dx) - h",
    "x = 1 / 0",
]


def found(lines):
    return unit_slips(ast.parse(f"def reward_function(params):\n    h = params['heading']\n    {lines}\n"))


@pytest.mark.parametrize("lines", SLIPS)
def test_a_slip_is_named_with_its_line(lines):
    (slip,) = found(lines)
    assert SLIPS[lines] in slip.text
    assert slip.line == 2 + len(lines.splitlines())


@pytest.mark.parametrize("lines", FITTING)
def test_what_fits_is_left_alone(lines):
    assert found(lines) == []


def test_no_sample_slips():
    assert [name for name in sample_names() if unit_slips(ast.parse(read_sample(name)))] == []
