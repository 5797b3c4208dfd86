"""A board moves because the console looks at the league's folder."""

import os
import time
from dataclasses import asdict

from racecraft.console.race_watch import LEFT_SECONDS, RaceWatch
from racecraft.league.race import Driving, Entry, Race, Result
from racecraft.league.store import League


def test_whoever_writes_an_entry_or_a_result_the_race_is_named_once(tmp_path):
    league = League.open_or_create(tmp_path / "league")
    watch = RaceWatch(tmp_path / "league")
    assert watch.changed() is None

    def named():
        time.sleep(0.01)  # a file system's clock may tick as slowly
        return (watch.changed() or {}).get("changed"), watch.changed()

    race = league.add_race(Race(id="", title="Club", kind="deepracer", tracks=("Oval_track",), rules={}))
    other = league.add_race(Race(id="", title="Other", kind="deepracer", tracks=("Oval_track",), rules={}))
    assert named() == ([race.id, other.id], None)
    league.add_entry(race.id, lambda folder: Entry(number=0, racer="Mia", model="m", entered=1.0))
    assert named() == ([race.id], None)
    league.save_result(other.id, Result(heat="00001", entries=(1,), drives=(), judged=1.0), {})
    assert named() == ([other.id], None)


def test_a_heat_is_told_while_it_is_driven_and_forgotten_when_its_judge_is_no_more(tmp_path):
    league = League.open_or_create(tmp_path / "league")
    race = league.add_race(Race(id="", title="Club", kind="deepracer", tracks=("Oval_track",), rules={})).id
    watch = RaceWatch(tmp_path / "league")
    assert watch.driving() == {}
    driving = Driving(racers=("Mia",), share=0.5, text="lap 2 of 3, 50 %", places=((1.5, -0.25),))
    league.save_driving(race, driving)
    assert watch.driving() == {race: asdict(driving)}
    assert RaceWatch(tmp_path / "league", "another").driving() == {}
    long_ago = time.time() - LEFT_SECONDS - 1.0
    os.utime(league.folder(race) / "driving.json", (long_ago, long_ago))
    assert watch.driving() == {}
    league.save_driving(race, None)
    assert not (league.folder(race) / "driving.json").exists()
