import ast
import csv

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.driving.lap_times import direction_named
from racecraft.worlds.deepracer.driving.line_file import COLUMNS, line_rows, write_line
from racecraft.worlds.deepracer.driving.lines import classical_line
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track


@pytest.fixture(scope="module")
def line():
    return classical_line(load_track("reinvent_base"), PROFILES["v6"], 2.5, "centre")


def test_every_kind_of_file_holds_the_same_line(tmp_path, line):
    for ending in ("csv", "npy", "py"):
        write_line(line, tmp_path / f"line.{ending}", "reinvent_base")
    rows = line_rows(line)
    assert np.array_equal(np.load(tmp_path / "line.npy"), rows)
    with (tmp_path / "line.csv").open() as file:
        read = list(csv.DictReader(file))
    assert np.allclose([[float(row[name]) for name in COLUMNS] for row in read], rows, rtol=1e-4, atol=1e-5)
    pasted = ast.literal_eval((tmp_path / "line.py").read_text().split("RACING_LINE = ")[1])
    assert np.allclose(pasted, rows[:, :4], atol=1e-3)


def test_an_unknown_ending_is_refused_by_name(tmp_path, line):
    with pytest.raises(SettingError, match=r"line.txt"):
        write_line(line, tmp_path / "line.txt", "reinvent_base")


def test_directions_are_understood_by_turn_and_by_file():
    loop, open_track = load_track("reinvent_base"), load_track("Straight_track")  # counter-clockwise
    assert [direction_named(loop, word) for word in ("forward", "ccw", "cw", "reverse")] == [
        "forward", "forward", "reverse", "reverse",
    ]  # fmt: skip
    with pytest.raises(SettingError, match="open track"):
        direction_named(open_track, "reverse")
