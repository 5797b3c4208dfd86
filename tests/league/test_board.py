"""Scores and places from laps alone."""

import pytest

from racecraft.league.board import board_of
from racecraft.league.heats import Heat, next_heat, remaining
from racecraft.league.race import Drive, Entry, Outcome, Race, Result


def race(**values):
    return Race(id="r", title="R", kind="k", tracks=("t",), rules={}, **values)


def entries(*racers):
    return {
        number: Entry(number=number, racer=racer, model=f"m{number}", entered=float(number))
        for number, racer in enumerate(racers, start=1)
    }


def result(number, *tracks, **values):
    drives = tuple(
        Drive(track="t", seed=0, outcomes=(Outcome(laps=tuple(laps), total_seconds=0.0, progress_percent=0.0),))
        for laps in tracks
    )
    return Result(heat=f"{number:05}", entries=(number,), drives=drives, judged=float(number), **values)


def places(race, entries, *results):
    rows = board_of(race, entries, {one.heat: one for one in results}).rows
    return [(row.place, row.racer, row.score, row.gap) for row in rows]


def test_each_racer_stands_by_the_best_of_all_entries():
    found = places(
        race(),
        entries("Ann", "Bob", "Ann", "Cy", "Dee"),
        result(1, [9.0, 8.5]),
        result(2, [8.25, None]),
        result(3, [8.75]),
        result(4, [None]),
    )
    assert found == [(1, "Bob", 8.25, 0.0), (2, "Ann", 8.5, 0.25), (None, "Cy", None, None), (None, "Dee", None, None)]


def test_equal_scores_share_a_place_and_the_next_one_is_left_out():
    found = places(race(), entries("Ann", "Bob", "Cy"), result(1, [8.0]), result(2, [8.0]), result(3, [9.0]))
    assert [row[:2] for row in found] == [(1, "Ann"), (1, "Bob"), (3, "Cy")]


@pytest.mark.parametrize(
    ("ranking", "laps", "score"),
    [
        ({"ranking": "best"}, [9.0, None, 8.0], 8.0),
        ({"ranking": "average", "window": 2}, [9.0, 10.0, None, 8.0, 10.0], 9.0),
        ({"ranking": "total", "window": 3}, [9.0, 10.0, 8.0, 8.5], 26.5),
        ({"ranking": "total", "window": 3}, [9.0, None, 8.0, 8.5], None),
        ({"ranking": "laps"}, [9.0, 10.0, None], 2.0),
    ],
)
def test_what_decides_a_race(ranking, laps, score):
    assert places(race(**ranking), entries("Ann"), result(1, laps))[0][2] == score


def test_most_laps_win_and_among_equals_the_quicker():
    found = places(
        race(ranking="laps"),
        entries("Ann", "Bob", "Cy"),
        result(1, [9.0, 9.0]),
        result(2, [9.0, 8.0]),
        result(3, [5.0]),
    )
    assert [row[1] for row in found] == ["Bob", "Ann", "Cy"]


def test_a_cup_adds_its_tracks_up_and_wants_all_of_them():
    found = places(race(), entries("Ann", "Bob"), result(1, [8.0], [12.0]), result(2, [7.0], [None]))
    assert found == [(1, "Ann", 20.0, 0.0), (None, "Bob", None, None)]


def test_an_entry_that_could_not_be_driven_says_why():
    failed = Result(heat="00001", entries=(1,), drives=(), judged=1.0, failure="damaged")
    (row,) = board_of(race(), entries("Ann"), {"00001": failed}).rows
    assert (row.place, row.failure) == (None, "damaged")


def test_a_meeting_that_could_not_be_driven_is_nobodys_win_and_says_why():
    def met(*numbers, **values):
        outcomes = tuple(Outcome(place=place, total_seconds=9.0 + place) for place in (2, 1))
        drives = () if values else (Drive(track="t", seed=0, outcomes=outcomes),)
        return Result(heat="{:05}-{:05}".format(*numbers), entries=numbers, drives=drives, judged=1.0, **values)

    results = {one.heat: one for one in (met(1, 2), met(1, 3, failure="damaged"), met(2, 3))}
    rows = board_of(race(format="round_robin"), entries("Ann", "Bob", "Cy"), results).rows
    assert [(row.racer, row.score) for row in rows] == [("Cy", 1.0), ("Bob", 1.0), ("Ann", 0.0)]
    assert [row.failure for row in rows] == ["", "", "damaged"]


def test_a_racer_who_enters_again_meets_everybody_anew():
    robin, twice = race(format="round_robin"), entries("Ann", "Bob", "Cy", "Ann")
    heats = {name: Result(heat=name, entries=(), drives=(), judged=1.0)
             for name in ("00001-00002", "00001-00003", "00002-00003")}  # fmt: skip
    assert remaining(robin, twice, heats) == 2
    assert next_heat(robin, twice, heats) == Heat("00002-00004", (2, 4))
