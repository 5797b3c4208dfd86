"""The laps of a run in the console: of its training, of evaluations and of races, chosen as the command would."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import as_log, drive, stadium

from racecraft.console import paging
from racecraft.console.parts import RaceDrive
from racecraft.contract.errors import SettingError
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.console import laps as laps_tab
from racecraft.worlds.deepracer.files.sim_trace import write_sim_trace


def at_speed(*speeds_mps):
    """Return the ticks of a lap at each speed; the number of the action that each chooses is its own."""
    return as_log([drive(lambda arc, mps=mps: np.full_like(arc, mps)) for mps in speeds_mps])


def write_judged(folder, ticks, reverse=False):
    """Write ticks as the trace of a drive that looks where it goes."""
    x, y = ticks["x_m"].to_numpy(), ticks["y_m"].to_numpy()
    x, y = (x[::-1], y[::-1]) if reverse else (x, y)
    columns = {
        "episode": ticks["episode"], "steps": ticks["tick"], "X": x, "Y": y, "steer": ticks["steering_rad"],
        "yaw": np.degrees(np.arctan2(np.gradient(y), np.gradient(x))), "throttle": ticks["speed_mps"],
        "action": ticks["action"], "reward": ticks["reward"], "done": ticks["status"] == "lap_complete",
        "all_wheels_on_track": ticks["reward"] > 0, "progress": 100.0 * ticks["progress_share"],
        "closest_waypoint": ticks["closest_waypoint"], "track_len": ticks["track_length_m"],
        "tstamp": ticks["time_s"], "episode_status": ticks["status"].cast(str), "pause_duration": 0.0 * ticks["reward"],
    }  # fmt: skip
    folder.mkdir(parents=True)
    write_sim_trace(folder / "0-iteration.csv", {name: np.asarray(column) for name, column in columns.items()})


@pytest.fixture
def run(tmp_path):
    """A run of three laps."""
    np.save(tmp_path / "stadium.npy", stadium().rows)
    job = {"kind": "deepracer", "track": {"name": "stadium"}, "asked": {"track": str(tmp_path / "stadium.npy")}}
    made = RunFolder.create(tmp_path / "run", job)
    made.episodes.mkdir(exist_ok=True)
    write_episodes(made.episodes / "1.parquet", at_speed(2.0, 3.0, 4.0).to_dict(as_series=False))
    return made.path


def test_conditions_choose_laps_and_stand_in_form_file_and_command(run):
    every = laps_tab.laps_page(run, {"actions": "", "turn": ""})
    shown = laps_tab.laps_page(run, {"actions": "1", "clean": "1"})
    assert [len(one["told"]["laps"]["rows"]) for one in (every, shown)] == [3, 1]
    values = {one["name"]: one["value"] for one in shown["conditions"] if one["value"]}
    assert values == {"actions": "1", "clean": True}
    assert shown["file"] == "lap.csv?clean=True&actions=1&lap=1"
    assert "--clean --actions=1 --line=lap.csv" in shown["command"]
    assert every["file"] == "lap.csv?lap=1"


def test_judged_laps_stand_among_the_trainings_with_their_source(run, tmp_path, monkeypatch):
    write_judged(run / "evaluation-20261128120500/evaluation-simtrace", at_speed(3.5))
    write_judged(run / "evaluation-20261128130000/evaluation-simtrace", at_speed(6.0), reverse=True)
    write_judged(tmp_path / "heat/car-1/leaderboard-simtrace", at_speed(5.0))
    race = SimpleNamespace(title="Club evening", rules={"reverse": False})
    elsewhere = RaceDrive(race, "Oval_track", tmp_path / "gone", 0)
    drives = [RaceDrive(race, "stadium", tmp_path / "heat", 0), elsewhere]

    def names(**query):
        shown = laps_tab.laps_page(run, query, drives)["told"]["laps"]["rows"]
        return [row["name"].rpartition(", episode")[0] for row in shown]

    training = ["iteration 0"] * 3
    judged = "evaluation of 2026-11-28 12:05"
    assert names() == ["Club evening", training[0], judged, *training[1:]]
    assert [names(phase=phase) for phase in ("training", "evaluation", "leaderboard")] == [
        training, [judged], ["Club evening"]
    ]  # fmt: skip
    shown = laps_tab.laps_page(run, {"lap": "2", "against": "1"}, drives)
    assert shown["told"]["gap"].startswith("+")
    assert str(tmp_path / "heat/car-1") in shown["command"]
    monkeypatch.setattr(paging, "PAGE", 3)
    first = laps_tab.laps_page(run, {}, drives)
    assert [row["href"] for row in first["told"]["laps"]["rows"]] == ["laps?lap=1", "laps?lap=2", "laps?lap=3"]
    assert first["pages"]["behind"].startswith("laps?after=")


@pytest.mark.parametrize(("query", "words"), [
    ({"actions": "0,7"}, "--actions 0,7"), ({"fastest": "many"}, "--fastest"), ({"at": "57"}, "57=left"),
    ({"future_at": "57=1"}, "--discount"), ({"top_speed": "9"}, "none of the 3 full laps"),
])  # fmt: skip
def test_conditions_that_cannot_be_are_named(run, query, words):
    with pytest.raises(SettingError, match=words):
        laps_tab.laps_page(run, query)
