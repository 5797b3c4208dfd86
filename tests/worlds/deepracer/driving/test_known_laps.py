import pytest

from racecraft.contract.errors import InputFileError
from racecraft.worlds.deepracer.driving.known_laps import (
    FORWARD,
    REVERSE,
    TABLE,
    KnownLap,
    best_known_lap,
    read_laps,
    record_lap,
)
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names

LAP = KnownLap("reinvent_base", "forward", "v6", 2.5, "7x1.5,2.5", 5.8, "plan", "0.1.0")


def test_a_faster_lap_takes_the_place_of_a_slower_one_and_never_the_reverse(tmp_path):
    file = tmp_path / "laps.csv"
    assert record_lap(LAP, file)
    assert not record_lap(KnownLap(**{**vars(LAP), "lap_seconds": 5.9}), file)
    assert record_lap(KnownLap(**{**vars(LAP), "lap_seconds": 5.6, "how": "runs/fast-1"}), file)
    assert [(lap.lap_seconds, lap.how) for lap in read_laps(file)] == [(5.6, "runs/fast-1")]


def test_laps_of_other_cars_speeds_and_directions_are_kept_apart(tmp_path):
    file = tmp_path / "laps.csv"
    for change in ({}, {"direction": REVERSE}, {"car": "v4"}, {"top_speed_mps": 4.0}):
        assert record_lap(KnownLap(**{**vars(LAP), **change}), file)
    assert len(read_laps(file)) == 4


def test_a_damaged_row_is_named_by_its_line(tmp_path):
    file = tmp_path / "laps.csv"
    record_lap(LAP, file)
    file.write_text(file.read_text() + "reinvent_base,forward,v6,fast\n")
    with pytest.raises(InputFileError, match=r"laps.csv:3"):
        read_laps(file)


def test_the_shipped_table_has_every_track_both_ways_for_each_car_and_top_speed():
    laps = read_laps(TABLE)
    ways = {(name, FORWARD) for name in names()} | {(name, REVERSE) for name in names() if load_track(name).closed}
    assert {lap.car for lap in laps} <= set(PROFILES)
    of_cars = {(lap.car, lap.top_speed_mps) for lap in laps}
    assert {("v6", 2.5), ("v5-classic", 4.0), ("v4", 4.0), ("v6", 4.0)} <= of_cars
    for car in of_cars:
        assert {(lap.track, lap.direction) for lap in laps if (lap.car, lap.top_speed_mps) == car} == ways
    assert all(1.0 < lap.lap_seconds < 200.0 for lap in laps)
    one = laps[0]
    assert best_known_lap(one.track, one.car, one.top_speed_mps, one.direction) == one.lap_seconds
