"""A judge that is killed at any moment loses nothing but the drive it was in."""

import os
import signal
import subprocess
import sys
import time

import pytest
from tests.league.in_process import InProcess
from tests.league.test_seasons import add

from racecraft.contract.errors import UserInputError
from racecraft.league import judging
from racecraft.league.race import Entry
from racecraft.league.store import League

JUDGE = """
import sys, time
from racecraft.league import judging
from racecraft.league.race import Outcome
from racecraft.league.store import League
from racecraft.league.world_part import Driven

class Driver:
    layers = ()
    def __init__(self, kind): pass
    def __enter__(self): return self
    def __exit__(self, *error): pass
    def close(self): pass
    def drive(self, order, on_progress):
        time.sleep(0.02)
        outcome = Outcome(laps=(float(order.seed),), total_seconds=1.0, progress_percent=100.0)
        return Driven((outcome,), {"a/drive.bin": b"0" * 200_000, "b.csv": b"1"})

judging.DriveProcess = Driver
league = League(sys.argv[1])
print("ready", flush=True)
judging.judge(league, league.race("club"))
"""
ENTRIES = 12


@pytest.fixture
def league(tmp_path):
    made = League.open_or_create(tmp_path / "league")
    add(made, "Club", {})
    for number in range(ENTRIES):
        made.add_entry(
            "club", lambda folder, number=number: folder.mkdir() or Entry(number=0, racer=f"R{number}", model="m",
                                                                          entered=0.0)
        )  # fmt: skip
    return made


def judge(league):
    process = subprocess.Popen([sys.executable, "-c", JUDGE, str(league.path)], stdout=subprocess.PIPE)
    process.stdout.readline()
    return process


def kill_at(league, moments):
    before = 0
    for seconds in moments:
        process = judge(league)
        time.sleep(seconds)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        now = len(league.results("club"))  # each of them reads
        assert now >= before
        before = now
    process = judge(league)
    assert process.wait() == 0
    process.stdout.close()
    results = league.results("club")
    assert list(results) == [f"{number:05}" for number in range(1, ENTRIES + 1)]
    for heat, result in results.items():
        drive = result.drives[0]
        assert drive.outcomes[0].laps == (float(league.seed("club", heat, 0)),), (
            "the seed is the heat's, whoever judges"
        )
        assert (league.folder("club") / drive.folder / "a/drive.bin").stat().st_size == 200_000


def test_three_kills_lose_nothing(league):
    kill_at(league, (0.01, 0.05, 0.13))


@pytest.mark.long
def test_twenty_kills_lose_nothing(league):
    kill_at(league, [0.007 * number for number in range(20)])


def test_two_judges_do_not_drive_one_race(league):
    with league.judging("club"), pytest.raises(UserInputError, match="another process judges it"):
        judging.judge(league, league.race("club"))


def test_a_driver_that_crashes_is_a_failed_entry_and_the_race_goes_on(league, monkeypatch):
    class Crash(InProcess):
        def drive(self, order, recorded=None, on_progress=None):
            raise judging.DriveError("the process that drove ended (SIGSEGV)")

    monkeypatch.setattr(judging, "DriveProcess", Crash)
    judged = judging.judge(league, league.race("club"))
    assert {one.result.failure for one in judged} == {"the process that drove ended (SIGSEGV)"}
    assert len(judged) == ENTRIES
    assert os.listdir(league.folder("club") / "drives") == []
