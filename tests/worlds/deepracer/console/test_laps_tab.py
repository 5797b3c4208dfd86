"""The laps of a run in the console: those that count, as the command would choose them."""

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import as_log, drive, stadium

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.console import laps as laps_tab
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A run of three laps; the number of the action that each chooses is its own."""
    log = as_log([drive(lambda arc, k=k: np.full_like(arc, 2.0 + k)) for k in range(3)])
    timing = time_laps(find_laps(log, stadium()))
    monkeypatch.setattr(laps_tab, "_timing", lambda run, changed: (timing, None))
    return tmp_path


def test_conditions_choose_laps_and_stand_in_form_file_and_command(run):
    every = laps_tab.laps_page(run, {"actions": "", "turn": ""})
    shown = laps_tab.laps_page(run, {"actions": "1", "clean": "1"})
    assert [len(one["told"]["laps"]["rows"]) for one in (every, shown)] == [3, 1]
    values = {one["name"]: one["value"] for one in shown["conditions"] if one["value"]}
    assert values == {"actions": "1", "clean": True}
    assert shown["file"] == "lap.csv?clean=True&actions=1&lap=1"
    assert "--clean --actions=1 --line=lap.csv" in shown["command"]
    assert every["file"] == "lap.csv?lap=1"


@pytest.mark.parametrize(("query", "words"), [
    ({"actions": "0,1"}, "none of the 3 full laps"), ({"fastest": "many"}, "--fastest"), ({"at": "57"}, "57=left"),
    ({"future_at": "57=1"}, "--discount"),
])  # fmt: skip
def test_conditions_that_cannot_be_are_named(run, query, words):
    with pytest.raises(SettingError, match=words):
        laps_tab.laps_page(run, query)
