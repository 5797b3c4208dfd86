"""What is kept of a race while it changes is what one reads who begins anew."""

import random

import pytest

from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.records import fastest_laps
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League


def enter(league, race, dice):
    racer = dice.choice(["Ann", "Bob", "Cy", "Dee"])
    league.add_entry(race, lambda folder: folder.mkdir() or Entry(number=0, racer=racer, model="m", entered=0.0))


def judge(league, race, dice):
    waiting = [number for number in league.entries(race) if f"{number:05}" not in league.results(race)]
    if waiting:
        number, laps = dice.choice(waiting), tuple(dice.choice([None, 7.0, 8.0, 9.0]) for _ in range(2))
        drive = Drive(track="t", seed=0, outcomes=(Outcome(laps=laps),))
        judged = Result(heat=f"{number:05}", entries=(number,), drives=(drive,) * dice.choice([1, 1, 0]), judged=1.0)
        league.save_result(race, judged, {})


def withdraw(league, race, dice):
    if entries := list(league.entries(race)):
        league.withdraw(race, dice.choice(entries))


def reset(league, race, dice):
    if heats := list(league.results(race)):
        league.reset(race, dice.choice(heats))


@pytest.mark.parametrize("ranking", ["best", "laps"])
def test_a_board_that_goes_on_is_the_board_that_is_made_anew(tmp_path, ranking):
    league, dice = League.open_or_create(tmp_path / "league"), random.Random(ranking)
    race = league.add_race(Race(id="", title="R", kind="k", tracks=("t",), rules={}, ranking=ranking))
    for _ in range(60):
        for act in dice.choices([enter, judge, withdraw, reset], [4, 5, 1, 1], k=dice.choice([1, 3])):
            act(league, race.id, dice)
        now, anew = snapshot_of(league, league.race(race.id)), snapshot_of(League(league.path), race)
        assert snapshot_of(league, now.race) is now
        assert (list(now.board.rows), now.board.waiting) == (list(anew.board.rows), anew.board.waiting)
        assert [now.board.row_of(row.racer) for row in now.board.rows] == list(now.board.rows)
        assert fastest_laps(league) == fastest_laps(League(league.path))
        assert fastest_laps(league, each=2) == fastest_laps(league)[:2]
