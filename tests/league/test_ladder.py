"""Who meets next on a ladder, when it is over, and what its board says; from places alone."""

from racecraft.league.board import board_of
from racecraft.league.board_table import table_of
from racecraft.league.heats import next_heat, remaining
from racecraft.league.race import LADDER, Drive, Entry, Outcome, Race, Result


def ladder(**values):
    return Race(id="r", title="R", kind="k", tracks=("t",), rules={}, format=LADDER, **values)


def entries(*racers):
    return {
        number: Entry(number=number, racer=racer, model=racer.lower(), entered=float(number))
        for number, racer in enumerate(racers, start=1)
    }


def played(heat, *games):
    """Return the result of games in which the lower number always wins."""
    places = {number: sorted(heat.entries).index(number) + 1 for number in heat.entries}
    outcomes = tuple(Outcome(places=(places[number],) * 2, faults=number) for number in heat.entries)
    drive = Drive(track="t", seed=0, outcomes=outcomes)
    return Result(heat=heat.name, entries=heat.entries, drives=(drive,), judged=1.0)


def play_all(race, found):
    results = {}
    while (heat := next_heat(race, found, results)) is not None:
        assert remaining(race, found, results) > 0
        results[heat.name] = played(heat)
    assert remaining(race, found, results) == 0
    return results


def test_everybody_plays_and_the_number_of_meetings_is_what_was_asked():
    results = play_all(ladder(meetings=5), entries("Ann", "Bob", "Cy", "Dee"))
    assert len(results) == 10
    assert {number for one in results.values() for number in one.entries} == {1, 2, 3, 4}


def test_fours_sit_at_one_board():
    results = play_all(ladder(meetings=3, grid=4), entries(*"ABCDEF"))
    assert len(results) == 5
    assert all(len(set(one.entries)) == 4 for one in results.values())


def test_nothing_is_played_before_enough_are_there():
    assert next_heat(ladder(grid=3), entries("Ann", "Bob"), {}) is None
    assert remaining(ladder(grid=3), entries("Ann", "Bob"), {}) == 0


def test_who_wins_more_stands_higher_and_the_board_says_how_sure_that_is():
    race, found = ladder(meetings=6), entries("Ann", "Bob", "Cy")
    rows = board_of(race, found, play_all(race, found)).rows
    assert [(row.place, row.racer) for row in rows] == [(1, "Ann"), (2, "Bob"), (3, "Cy")]
    assert all(row.score_range[0] < row.score < row.score_range[1] for row in rows)
    assert rows[0].wins == rows[0].games > 0
    assert rows[2].wins == 0
    assert rows[2].faults == 3 * rows[2].games // 2


def test_a_new_entry_of_a_racer_plays_anew_and_games_of_the_old_one_still_tell_of_others():
    race, found = ladder(meetings=4), entries("Ann", "Bob")
    before = play_all(race, found)
    found = entries("Ann", "Bob", "Ann")
    board = board_of(race, found, before)
    assert [(row.racer, row.entry, row.place) for row in board.rows] == [("Bob", 2, 1), ("Ann", 3, None)]
    assert board.rows[0].games == 8
    assert board.waiting == 1
    assert set(next_heat(race, found, before).entries) == {2, 3}
    assert remaining(race, found, before) == 4


def test_a_heat_that_failed_rates_nobody_and_is_told():
    failed = Result(heat="meeting-00001", entries=(1, 2), drives=(), judged=1.0, failure="no answer")
    race, found = ladder(), entries("Ann", "Bob")
    heads, rows = table_of(board_of(race, found, {failed.heat: failed}))
    assert [row[heads.index("note")] for row in rows] == ["no answer", "no answer"]
    assert [row[heads.index("rating")] for row in rows] == ["–", "–"]
    assert next_heat(race, found, {failed.heat: failed}).name == "meeting-00002"
