"""What a race cannot be is refused before it is made or changed, and nothing is left of it."""

import pytest

import racecraft as rc
from racecraft.contract.errors import UserInputError
from racecraft.league.store import League


@pytest.fixture(scope="module")
def league(tmp_path_factory):
    """A league with two races of one title, one with a deadline that has passed, and a practice race."""
    folder = tmp_path_factory.mktemp("club") / "league"
    for title in ("Twice", "Twice"):
        rc.create_race(title, league=folder)
    rc.create_race("Over", league=folder, closes="2020-01-01")
    rc.create_race("Practice", league=folder, practice=True)
    return folder


REFUSED = {
    "no title": (rc.create_race, {"title": " "}, "the title is empty"),
    "an infinite deadline": (rc.create_race, {"title": "A", "closes": "+infh"}, "--closes is '\\+infh'"),
    "a deadline in 300,000 years": (rc.create_race, {"title": "A", "closes": "+99999999d"}, "--closes is"),
    "closes first": (rc.create_race, {"title": "A", "closes": "2020-01-01", "opens": "2021-01-01"}, "not after --open"),
    "practice with a deadline": (rc.create_race, {"title": "A", "closes": "+2h", "practice": True}, "always open"),
    "a window of best laps": (rc.create_race, {"title": "A", "window": 2}, "--window counts laps of --ranking average"),
    "a window too wide": (rc.create_race, {"title": "A", "window": 4, "ranking": "total"}, "--window is 4"),
    "boxes on an empty road": (rc.create_race, {"title": "A", "boxes": 3}, "--boxes is of --type OBJECT_AVOIDANCE"),
    "cars that meet alone": (rc.create_race, {"title": "A", "type": "HEAD_TO_MODEL"}, "--format solo do not fit"),
    "no number of actions": (rc.create_race, {"title": "A", "min_actions": 5, "max_actions": 3}, "--min-actions is 5"),
    "laps without a time": (rc.create_race, {"title": "A", "ranking": "laps"}, "--race-seconds go together"),
    "a title of two": (rc.show_race, {"race": "TWICE"}, "2 races are called"),
    "no new title": (rc.edit_race, {"race": "over", "title": ""}, "the title is empty"),
    "closed practice": (rc.close_race, {"race": "practice"}, "practice race, which is always open"),
    "opened after the deadline": (rc.open_race, {"race": "over"}, "deadline of over has passed.* edit over --closes"),
    "a racer without a name": (rc.enter_race, {"race": "practice", "model": "m", "racer": ""}, "racer's name is ''"),
    "a track of no race": (rc.show_records, {"track": "Oval"}, "no race is on 'Oval'"),
    "points below 0": (rc.create_season, {"title": "S", "points": "3,-1"}, "expected no negative points"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_and_the_league_stays_as_it_was(league, case):
    act, options, reason = REFUSED[case]
    before = League(league).races()
    with pytest.raises(UserInputError, match=reason):
        act(**options, league=league)
    assert League(league).races() == before
    assert not League(league).seasons()
