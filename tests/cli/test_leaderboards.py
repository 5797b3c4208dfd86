"""`racecraft leaderboards` and the tracks of 2019 that nobody has."""

from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.actions.leaderboards import _on_track, leaderboards
from racecraft.worlds.deepracer.files.leaderboards import WITHOUT_ROUTE, read_leaderboards
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names

RACES = """\
Arn,Name,LaunchTime,TrackArn,MinimumLaps,RaceType,TimingMethod
arn:a,Toronto Turnpike,1569888000000,x::track/Canada_Race,1,TIME_TRIAL,BEST_LAP_TIME
"""
RENAMED = """\
arn:b,Final of 2022,1669888000000,x::track/2022_reinvent_champ,1,TIME_TRIAL,BEST_LAP_TIME
arn:c,Final of 2024,1733888000000,x::track/2024_reinvent_champ,1,TIME_TRIAL,BEST_LAP_TIME
"""


def test_a_race_on_a_track_that_nobody_has_is_listed_and_its_letter_tells_what_to_bring(racecraft, tmp_path):
    (tmp_path / "leaderboards.csv").write_text(RACES)
    assert "Toronto Turnpike" in racecraft("leaderboards", ".", "--track", "Canada_Race").out
    told = racecraft("leaderboards", ".", "--run", "run", "--track", "Canada_Race")
    assert told.code == 2
    letter = " ".join(told.err.split())
    assert "Canada_Training, as far as known another circuit" in letter
    assert "--track Canada_Race.npy" in letter


def test_a_route_file_of_ones_own_finds_its_races(tmp_path):
    (tmp_path / "leaderboards.csv").write_text(RACES)
    np.save(tmp_path / "canada_race.npy", np.asarray(load_track("Canada_Training").rows))
    own = load_track(tmp_path / "canada_race.npy")
    assert [board.name for board in _on_track(read_leaderboards(tmp_path), own.name)] == ["Toronto Turnpike"]


@pytest.mark.parametrize("year", ["2022", "2024"])
def test_a_track_that_was_renamed_finds_its_races(tmp_path, year):
    """The archive calls it 2022_reinvent_champ, its route file 2022_reinvent_champ_ccw."""
    (tmp_path / "leaderboards.csv").write_text(RACES + RENAMED)
    circuit = load_track(f"{year}_reinvent_champ")
    assert circuit.name != f"{year}_reinvent_champ"
    for name in (circuit.name, f"{year}_reinvent_champ"):
        assert [board.name for board in _on_track(read_leaderboards(tmp_path), name)] == [f"Final of {year}"]


def test_a_track_without_races_is_told_before_the_run_drives(tmp_path, monkeypatch):
    (tmp_path / "leaderboards.csv").write_text(RACES)
    car = SimpleNamespace(trained_on=load_track("Oval_track"))  # whatever would drive it raises AttributeError
    monkeypatch.setattr("racecraft.worlds.deepracer.players.trained_car.load_trained_car", lambda *words: car)
    with pytest.raises(SettingError, match="no race on the track 'Oval_track'"):
        leaderboards(tmp_path, run="run")


def test_tracks_without_a_route_are_not_ours_and_those_for_practice_are():
    assert set(WITHOUT_ROUTE).isdisjoint(names())
    assert set(WITHOUT_ROUTE.values()) <= set(names())
