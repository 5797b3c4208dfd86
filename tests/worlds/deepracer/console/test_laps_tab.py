"""The laps of a run in the console: of its training, of evaluations and of races, chosen as the command would."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import LENGTH_M, as_log, at, drive, stadium

from racecraft.console import paging
from racecraft.console.parts import RaceDrive
from racecraft.contract.errors import SettingError
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.console import laps as laps_tab
from racecraft.worlds.deepracer.console.compared_laps import compared_laps
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
def made_run(tmp_path):
    """Makes runs in the stadium, of a lap at each speed."""
    np.save(tmp_path / "stadium.npy", stadium().rows)

    def make(name, *speeds_mps, reverse=False):
        job = {
            "kind": "deepracer", "track": {"name": "stadium"}, "asked": {"track": str(tmp_path / "stadium.npy")},
            "settings": {"race": {"reverse": reverse}},
        }  # fmt: skip
        made = RunFolder.create(tmp_path / name, job)
        made.episodes.mkdir(exist_ok=True)
        if speeds_mps:
            write_episodes(made.episodes / "1.parquet", at_speed(*speeds_mps).to_dict(as_series=False))
        return made.path

    return make


@pytest.fixture
def run(made_run):
    """A run of three laps."""
    return made_run("run", 2.0, 3.0, 4.0)


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


def test_the_fastest_laps_of_compared_runs_stand_on_one_map(run, made_run):
    slow, new = made_run("slow", 2.0), made_run("new")
    write_judged(run / "evaluation-20261128120500/evaluation-simtrace", at_speed(3.0))
    groups = [[("slow", str(slow))], [("run", str(run))], [("new", str(new))]]
    ticks = {mps: np.ceil(15 * LENGTH_M / mps) for mps in (1.0, 2.0, 3.0, 4.0)}

    def rows(told):
        return [(row["number"], row["name"], row["lap"], row["gap"]) for row in told["rows"]]

    def expected(slower, faster):
        lap, gap = ticks[faster] / 15, (ticks[slower] - ticks[faster]) / 15
        return [
            (2, "run", f"{lap:.2f} s", "+0.00 s"), (1, "slow", f"{ticks[slower] / 15:.2f} s", f"{gap:+.2f} s"),
            (3, "new", "", ""),
        ]  # fmt: skip

    told = compared_laps(groups)["told"]
    assert rows(told) == expected(2.0, 4.0)
    assert [car["number"] for car in told["cars"]] == [1, 2]
    for car, mps in zip(told["ghosts"]["cars"], (2.0, 4.0), strict=True):
        assert len(car) - 1 == pytest.approx(ticks[mps], abs=1)
        (place,), _ = at([mps * 2.0])
        assert np.hypot(car[30][0] - place[0], -car[30][1] - place[1]) < 0.15, "after 2 s"
    write_judged(slow / "evaluation-20261128120500/evaluation-simtrace", at_speed(1.0))
    told = compared_laps(groups)["told"]
    assert rows(told) == expected(1.0, 3.0), "once all cars have laps in evaluations, those"
    assert told["rows"][1]["source"].startswith("evaluation of 2026-11-28 12:05")


def test_seeds_have_a_car_each_and_groups_of_them_their_best_ones(run, made_run):
    seeds = [("a", str(run)), ("b", str(made_run("b", 2.0)))]
    for lap, (_, seed) in zip((9.0, 8.0), seeds, strict=True):
        (Path(seed) / "metrics.jsonl").write_text(json.dumps({"iteration": 1, "best_lap_seconds": lap}) + "\n")

    def names(*groups):
        return [row["name"] for row in compared_laps(groups)["told"]["rows"]]

    assert names(seeds) == ["a", "b"]
    assert names(seeds, [("c", str(run))]) == ["c", "b"]
    crowd = compared_laps([[("a", str(run))] * 8])
    assert (len(crowd["told"]["cars"]), crowd["told"]["left_out"]) == (6, 2)


def test_laps_that_cannot_share_a_map_are_not_drawn(run, made_run):
    back = made_run("back", reverse=True)
    write_judged(back / "evaluation-20261128130000/evaluation-simtrace", at_speed(3.0), reverse=True)
    ways = compared_laps([[("run", str(run))], [("back", str(back))]])
    none = compared_laps([[("new", str(made_run("new")))]])
    assert [one["told"] for one in (ways, none)] == [None, None]
    assert "directions" in ways["reason"]
    assert "full lap" in none["reason"]
