"""Snakes on the boards of a league: they enter, meet, are rated; their games are played again from recorded moves."""

import json
import shutil

import av
import pytest
from tests.league.in_process import InProcess
from tests.worlds.battlesnake.training.test_snake_training import run  # noqa: F401

import racecraft as rc
from racecraft.contract.errors import UserInputError
from racecraft.isolation.layers import can_isolate
from racecraft.league import auditing, judging
from racecraft.league.race import Drive, Outcome, Result
from racecraft.league.store import League
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.evaluation.game_files import verify_file
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

isolated = pytest.mark.skipif(not can_isolate(), reason="this system isolates no code")
SMALL = {"width": 7, "height": 7, "most_turns": 40, "timeout_ms": 2000, "meetings": 2}


@pytest.fixture
def here(monkeypatch):
    monkeypatch.setattr(judging, "DriveProcess", InProcess)
    monkeypatch.setattr(auditing, "DriveProcess", InProcess)


@pytest.fixture
def league(tmp_path):
    return tmp_path / "league"


def evening(league, *sources, **values):
    race = rc.create_snake_race("Evening", league=league, **{**SMALL, **values}).race
    for number, source in enumerate(sources, start=1):
        rc.enter_race(race.id, str(source), racer=f"Racer {number}", league=league)
    return race


def test_an_evening_is_judged_in_fresh_processes_rated_and_played_again_to_the_bit(run, league, tmp_path):  # noqa: F811
    shutil.make_archive(str(tmp_path / "mine"), "gztar", run[0].parent, run[0].name)
    race = evening(league, tmp_path / "mine.tar.gz", f"search:{run[0]}", timeout_ms=100)
    results = rc.judge_race(race.id, league=league).results
    assert [one.failure for one in results] == ["", ""]
    assert all("seccomp" in one.limits for one in results) or not can_isolate()
    rows = rc.show_board(race.id, league=league).board.rows
    assert sum(row.games for row in rows) == 8
    assert [row.place for row in rows] == [1, 2]
    audit = rc.audit_races(league=league)
    assert [one.differences for one in audit.heats] == [(), ()]
    kept = league / "races/evening/entries/00001/model/run"
    assert not list((kept / "episodes").iterdir())
    assert not list((kept / "evaluations").iterdir())


def test_a_heat_has_a_game_for_each_seat_and_leaves_files_that_the_rules_agree_with(league, here):
    race = evening(league, "flood_fill", "hungry", "random_safe", snakes=3, meetings=1)
    (result,) = rc.judge_race(race.id, league=league).results
    (drive,) = result.drives
    assert [len(one.places) for one in drive.outcomes] == [3, 3, 3]
    folder = league / "races/evening" / drive.folder
    for number in (1, 2, 3):
        assert verify_file(folder / f"game-{number}.jsonl").agrees
    told = json.loads((folder / "moves.json").read_text())
    assert len({game["moves"][0] for game in told["games"]}) > 1, "seats change"


def test_a_game_is_filmed_from_its_recorded_moves(league, here, tmp_path):
    race = evening(league, "flood_fill", "hungry", meetings=1)
    (result,) = rc.judge_race(race.id, league=league).results
    filmed = rc.film_race_drive(race.id, 2, league=league, out=tmp_path / "game.mp4")
    assert filmed.heat == result.heat
    with av.open(filmed.video) as film:
        assert film.streams.video[0].frames > 10


def test_an_audit_names_a_move_that_was_written_by_hand(league, here):
    race = evening(league, "flood_fill", "hungry", meetings=1)
    (result,) = rc.judge_race(race.id, league=league).results
    file = league / "races/evening" / result.drives[0].folder / "moves.json"
    told = json.loads(file.read_text())
    first = told["games"][0]["moves"][0]
    told["games"][0]["moves"][0] = "".join(str((int(one) + 1) % 4) for one in first)
    file.write_text(json.dumps(told))
    (one,) = rc.audit_races(league=league).different
    assert "digest" in one.differences[0]
    file.write_text("{")
    (one,) = rc.audit_races(league=league).different
    assert "expected moves that a league recorded" in one.differences[0]


def test_a_server_enters_by_its_address_and_one_that_is_gone_rates_nobody(league, here):
    thread = ServerThread(SnakeServer(find_player("flood_fill")).application, "snake")
    address = f"http://127.0.0.1:{thread.start('127.0.0.1', 0)}"
    try:
        race = evening(league, "hungry", address, meetings=1)
        (result,) = rc.judge_race(race.id, league=league).results
        assert result.failure == ""
    finally:
        thread.close()
    rc.reset_race(race.id, league=league)
    (result,) = rc.judge_race(race.id, league=league).results
    assert address in result.failure
    with pytest.raises(UserInputError, match="ConnectionRefusedError"):
        rc.enter_race(race.id, address, racer="Late", league=league)


TRICKS = {
    "reads a stranger's file": "open({secret!r}).read()",
    "lists a folder": "__import__('os').listdir({folder!r})",
    "writes a file": "open({folder!r} + '/was-here', 'w')",
    "makes a folder": "__import__('os').mkdir({folder!r} + '/was-here')",
    "removes a file": "__import__('os').remove({secret!r})",
    "starts a program": "__import__('subprocess').run(['/bin/true'])",
    "forks": "__import__('os').fork()",
    "opens a socket": "__import__('socket').socket()",
    "signals its owner": "__import__('os').kill(__import__('os').getppid(), 0)",
    "reads its owner's memory": "open('/proc/%d/mem' % __import__('os').getppid(), 'rb')",
    "starts a thread": "__import__('threading').Thread(target=print).start()",
}


@isolated
@pytest.mark.parametrize("trick", TRICKS)
def test_a_file_that_reaches_out_is_refused_by_the_system(league, tmp_path, trick):
    secret = tmp_path / "secret.txt"
    secret.write_text("a key")
    code = TRICKS[trick].format(secret=str(secret), folder=str(tmp_path))
    file = tmp_path / "snake.py"
    file.write_text(f"{code}\ndef move(data):\n    return 'up'\n")
    before = sorted(path for path in tmp_path.rglob("*"))
    race = rc.create_snake_race("Evening", league=tmp_path / "other", **SMALL).race
    with pytest.raises(
        UserInputError, match="snake.py:1: loading it raised (PermissionError|RuntimeError|OSError|Blocking)"
    ):
        rc.enter_race(race.id, str(file), league=tmp_path / "other")
    assert secret.read_text() == "a key"
    assert not list((tmp_path / "other/races/evening/entries").iterdir())
    assert [path for path in before if not path.exists()] == []


@isolated
def test_a_file_plays_and_does_not_see_its_owners_environment(league, here, tmp_path, monkeypatch):
    monkeypatch.setenv("A_SECRET_KEY", "1")
    file = tmp_path / "up.py"
    file.write_text("import os\ndef move(data):\n    return 'down' if 'A_SECRET_KEY' in os.environ else 'up'\n")
    race = evening(league, "hungry", file, meetings=1)
    (result,) = rc.judge_race(race.id, league=league).results
    told = json.loads((league / "races/evening" / result.drives[0].folder / "moves.json").read_text())
    assert {turn[1] for turn in told["games"][0]["moves"] if turn[1] != "-"} == {"0"}
    assert result.drives[0].outcomes[1].faults == 0


REFUSED = {
    "no such player": ("nobody", {}, "there is no player 'nobody'"),
    "a file": ("FILE", {"files": False}, "this race refuses a file"),
    "an address": ("http://127.0.0.1:9", {"addresses": False}, "this race refuses an address"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_who_may_not_enter_is_told_why_and_leaves_nothing(league, tmp_path, case):
    source, rules, reason = REFUSED[case]
    (tmp_path / "up.py").write_text("def move(data):\n    return 'up'\n")
    race = evening(league, **rules)
    with pytest.raises(UserInputError, match=reason):
        rc.enter_race(race.id, str(tmp_path / "up.py") if source == "FILE" else source, league=league)
    assert not list((league / "races/evening/entries").iterdir())


def test_a_map_that_does_not_exist_and_fours_in_a_bracket_are_refused(league):
    with pytest.raises(UserInputError, match="There is no map 'nowhere'"):
        evening(league, map_name=["nowhere"])
    with pytest.raises(UserInputError, match="--snakes 4 and --format bracket do not fit"):
        evening(league, snakes=4, format="bracket")


def test_a_bracket_of_snakes_on_two_maps_has_a_winner(league, here):
    race = evening(league, "flood_fill", "hungry", "random_safe", format="bracket", map_name=["standard", "empty"])
    rc.close_race(race.id, league=league)
    results = rc.judge_race(race.id, league=league).results
    assert [[drive.track for drive in one.drives] for one in results] == [["standard", "empty"]] * 2
    assert sorted(row.place for row in rc.show_board(race.id, league=league).board.rows) == [1, 2, 3]


def test_cars_and_snakes_of_one_league_are_audited_each_by_their_own_world(league, here, monkeypatch):
    class OfItsOwn(InProcess):
        def drive(self, order, recorded=None):
            assert self.kind == ("battlesnake" if "ruleset" in order.rules else "deepracer")
            return super().drive(order, recorded)

    monkeypatch.setattr(auditing, "DriveProcess", OfItsOwn)
    snakes = evening(league, "flood_fill", "hungry", meetings=1)
    rc.judge_race(snakes.id, league=league)
    cars = rc.create_race("Cars", league=league, track=["Oval_track"], laps=1).race
    store = League(league)
    drive = Drive(track="Oval_track", seed=1, outcomes=(Outcome(),), folder="drives/00001-0")
    store.save_result(cars.id, Result(heat="00001", entries=(1,), drives=(drive,), judged=1.0), {})
    heats = rc.audit_races(league=league).heats
    assert sorted((one.race, one.is_equal) for one in heats) == [("cars", False), ("evening", True)]
