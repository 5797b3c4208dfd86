"""What `racecraft why` wrote is shown; what cannot be read is asked for anew."""

import json

import pytest
from tests.console.conftest import write_run

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.console.why_tab import FACTS, why_data

CURE = {
    "seconds_before": 0.8, "waypoint": 40, "action": "15 degrees left", "instead_of": "straight", "held_seconds": 0.2,
    "saved": 3, "tried": 4,
}  # fmt: skip
PLACE = {
    "segment": "turn 2 (left)", "share": 0.75, "words": "3 of 4 failures lie here.", "xy": [[1.0, 2.0], [3.0, 4.0]],
    "picture_jpeg": "AAAA", "cures": [CURE],
}  # fmt: skip
WHY = {
    "checkpoint": 7,
    "findings": ["From 24 starts 4 failed."],
    "places": [PLACE],
    "paths": [[[0.0, 0.0], [1.0, 1.0]]],
}


def test_places_stand_on_the_map_where_cars_failed(tmp_path):
    run = RunFolder(write_run(tmp_path / "run"))
    (run.path / FACTS).write_text(json.dumps(WHY))
    why = why_data(run)["why"]
    assert [one["head"] for one in why["places"]] == ["1: turn 2 (left)"]
    assert (why["map"]["places"][0]["x"], why["map"]["places"][0]["y"]) == ("2.00", "-3.00")
    assert why["places"][0]["cures"][0][-1] == "3 of 4"


@pytest.mark.parametrize("text", [None, "{", json.dumps(WHY | {"places": [{}]})])
def test_what_was_not_written_or_is_damaged_is_asked_for_anew(tmp_path, text):
    run = RunFolder(write_run(tmp_path / "run"))
    if text is not None:
        (run.path / FACTS).write_text(text)
    assert why_data(run) == {"why": None, "page": ""}
