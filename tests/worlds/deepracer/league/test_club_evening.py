"""A race as a club runs it: made, entered, judged in a process of its own, audited; files and refusals."""

import json
import shutil

import av
import numpy as np
import pytest
from tests.cli.conftest import TINY, typed
from tests.league.in_process import InProcess

import racecraft as rc
from racecraft.console.parts import parts_of
from racecraft.contract.errors import UserInputError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.isolation.layers import can_isolate
from racecraft.league import auditing, judging
from racecraft.league.store import League
from racecraft.league.world_part import league_world
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.actions.telemetry import telemetry
from racecraft.worlds.deepracer.analysis.films import film, moments
from racecraft.worlds.deepracer.export.exporters import export_car
from racecraft.worlds.deepracer.logs import local_streams
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import route_file
from racecraft.worlds.deepracer.training.plan import RaceRequest


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    place = tmp_path_factory.mktemp("cars") / "mint"
    request = RaceRequest(preset="fast", run=place, stops=("iterations=1",), overrides=TINY[1::2])
    return train(request, NullCallback(), lambda text: None).run.path


@pytest.fixture
def here(monkeypatch):
    monkeypatch.setattr(judging, "DriveProcess", InProcess)
    monkeypatch.setattr(auditing, "DriveProcess", InProcess)


@pytest.fixture
def league(tmp_path):
    return tmp_path / "league"


SHORT = {"laps": 1, "max_resets": 1, "track": ["Oval_track"]}


def test_a_race_is_judged_in_a_fresh_process_and_driven_again_to_the_bit(run, league, monkeypatch):
    told = []
    monkeypatch.setattr(League, "save_driving", lambda self, race, driving: told.append(driving))
    race = rc.create_race("Club evening", league=league, **SHORT).race
    entered = rc.enter_race(race.id, run, racer="Mia", league=league).entry
    assert entered.facts["sensors"] == ["FRONT_FACING_CAMERA"]
    (result,) = rc.judge_race(race.id, league=league).results
    assert result.failure == ""
    assert [told[0].racers, told[-1]] == [("Mia",), None]
    shares = [one.share for one in told[:-1]]
    assert 0.0 <= shares[0] <= shares[-1] <= 1.0
    assert told[-2].text.startswith("lap 1 of 1, ")
    assert all(len(one.places) == 1 for one in told[1:-1])
    assert not can_isolate() or "seccomp" in result.limits
    audit = rc.audit_races(league=league)
    assert [(one.heat, one.is_equal) for one in audit.heats] == [("00001", True)]
    (row,) = rc.show_board("Club evening", league=league).board.rows
    assert (row.racer, row.model, row.submissions, row.waiting) == ("Mia", "mint", 1, 0)


def test_an_audit_names_a_lap_that_was_written_by_hand(run, league, here):
    season = rc.create_season("Winter", league=league).season.id
    race = rc.create_race("Club", league=league, season=season, **SHORT).race
    rc.enter_race(race.id, run, racer="Mia", league=league)
    rc.judge_race(race.id, league=league)
    file = league / "races/club/results/00001.json"
    told = json.loads(file.read_text())
    told["drives"][0]["outcomes"][0]["laps"] = [1.0]
    for machine in (told["machine"], "elsewhere"):
        file.write_text(json.dumps(told | {"machine": machine}))
        (one,) = rc.audit_races(league=league, season=season).different
        assert one.differences[0].startswith("entry 1 on Oval_track: laps 1.000000, now –")
        assert one.is_other_machine == (machine == "elsewhere")
    assert rc.show_board("club", league=league).board.rows[0].place == 1, "nobody is disqualified"


def test_boxes_stand_elsewhere_in_every_entry_and_where_they_stood_in_the_audit(run, league, here):
    race = rc.create_race("Boxes", league=league, type="OBJECT_AVOIDANCE", boxes=3, **SHORT).race
    for _ in range(2):
        rc.enter_race(race.id, run, league=league)
    first, second = (one.drives[0] for one in rc.judge_race(race.id, league=league).results)
    assert first.seed != second.seed
    assert first.outcomes[0].digest != second.outcomes[0].digest
    assert not rc.audit_races(league=league).different


OTHER_RACES = {
    "bots": {"type": "HEAD_TO_BOT", "bots": 2, "bot_lane_change": True, "max_resets": 1},
    "a fixed time": {"ranking": "laps", "race_seconds": 10.0},
}


@pytest.mark.parametrize("case", OTHER_RACES)
def test_races_with_bots_and_of_a_fixed_time_are_driven_again_to_the_bit(run, league, here, case):
    race = rc.create_race("Club", league=league, track=["Oval_track"], laps=1, **OTHER_RACES[case]).race
    rc.enter_race(race.id, run, league=league)
    (result,) = rc.judge_race(race.id, league=league).results
    if case == "a fixed time":
        assert result.drives[0].outcomes[0].total_seconds == 10.0
    (one,) = rc.audit_races(race.id, league=league).heats
    assert one.is_equal


HEATS = {
    "bracket": [("round-1-002", 1), ("round-2-001", 2)],  # of three the first moves on
    "round_robin": [("00001-00002", 0), ("00001-00003", 0), ("00002-00003", 0)],
}


@pytest.mark.parametrize("format", HEATS)
def test_cars_that_meet_drive_together_once_the_race_is_closed(run, league, here, monkeypatch, format):
    told = []
    monkeypatch.setattr(League, "save_driving", lambda self, race, driving: told.append(driving))
    monkeypatch.setenv("RACECRAFT_LEAGUE", str(league))
    assert (
        typed("league", "create", "Duel", "--track=Oval_track", "--laps=1", "--max-resets=1", "--format", format) == 0
    )
    for racer in ("Ann", "Bob", "Cy"):
        assert typed("league", "enter", "duel", run, "--racer", racer) == 0
    assert typed("league", "judge", "duel") == 2, "it still takes entries"
    assert typed("league", "close", "duel") == 0
    assert typed("league", "judge", "duel") == 0
    results = League(league).results("duel")
    assert [(one.heat, one.round) for one in results.values()] == HEATS[format]
    board = rc.show_board("duel", league=league).board
    assert sorted(row.place for row in board.rows) == [1, 2, 3]
    assert sum(row.score for row in board.rows) == len(results), "each heat is one win"
    places = {one.places for one in told if one and one.places}
    assert {len(one) for one in places} == {2}
    assert len(places) > 10, "they move"
    assert not rc.audit_races(league=league).different


def test_a_drive_is_found_under_the_leaderboards_name_and_read_as_a_log(run, league, here, monkeypatch):
    race = rc.create_race("Club", league=league, **SHORT).race
    rc.enter_race(race.id, run, league=league)
    (result,) = rc.judge_race(race.id, league=league).results
    drive = league / "races" / race.id / result.drives[0].folder
    ticks = rc.logs.read(drive).ticks.collect()
    assert set(ticks["phase"]) == {"leaderboard"}
    assert ticks.height == round(result.drives[0].outcomes[0].total_seconds * 15)
    monkeypatch.setenv("RACECRAFT_LEAGUE", str(league))
    monkeypatch.chdir(league)
    assert [one.path for one in local_streams.streams(local_streams.LEADERBOARDS)] == [drive]


def test_the_telemetry_of_a_racers_own_race_names_the_corner_that_cost_the_time(run, league, here, tmp_path):
    drives = []
    for penalty in (0.0, 5.0):
        race = rc.create_race("Club", league=league, laps=1, track=["Oval_track"], off_track_penalty=penalty).race
        rc.enter_race(race.id, run, league=league)
        (result,) = rc.judge_race(race.id, league=league).results
        drives.append((league / "races" / race.id / result.drives[0].folder, result.drives[0].outcomes[0]))
    (free, free_lap), (own, lap) = drives
    assert lap.penalty_seconds > 0
    found = telemetry(own, against=str(free)).figures.as_dictionary()
    assert found["lost_seconds"] == lap.penalty_seconds == lap.total_seconds - free_lap.total_seconds
    lost = {corner["name"]: corner["lost_seconds"] for corner in found["corners"]}
    assert all(seconds % 5.0 == 0.0 for seconds in lost.values())
    worst = max(lost, key=lambda name: lost[name])
    advice = f"Work on {worst}: it is worth {lost[worst]:.2f} s"
    assert found["advice"].startswith(advice)
    _, shown = parts_of("deepracer").drive_page(race, "Oval_track", [("Mia", own, 0), ("Jun", free, 0)], {})
    assert shown["told"]["advice"].startswith(advice)
    assert shown["told"]["gap"] == f"{lap.penalty_seconds:+.2f} s"
    assert shown["told"]["reference_name"].startswith("Jun's fastest lap, ")
    later, sooner = (len(car) for car in reversed(shown["told"]["ghosts"]["cars"]))
    assert later - sooner == pytest.approx(15 * lap.penalty_seconds, abs=1), "each car stands once its lap is over"
    for seat, folder in enumerate((own, free), start=1):  # as if they had met
        shutil.copytree(folder, tmp_path / f"heat/car-{seat}")
    met = [("Mia", tmp_path / "heat", 0), ("Jun", tmp_path / "heat", 1)]
    assert parts_of("deepracer").drive_page(race, "Oval_track", met, {})[1] == shown


def test_a_judged_drive_is_filmed_and_one_that_is_none_is_refused(run, league, here, tmp_path, monkeypatch):
    monkeypatch.setattr(moments, "HELD_SECONDS", 0.1)
    monkeypatch.setattr(film, "SIZES", {name: (160, 120) for name in film.SIZES})
    race = rc.create_race("Club", league=league, **SHORT).race
    rc.enter_race(race.id, run, league=league)
    with pytest.raises(UserInputError, match="club has no judged drive of entry 1"):
        rc.film_race_drive(race.id, 1, league=league)
    (result,) = rc.judge_race(race.id, league=league).results
    filmed = rc.film_race_drive(race.id, 1, league=league, out=tmp_path / "drive.mp4")
    assert filmed.heat == "00001"
    with av.open(filmed.video) as video:
        assert video.streams.video[0].frames >= round(result.drives[0].outcomes[0].total_seconds * 15)
    with pytest.raises(UserInputError, match="club has 1 tracks, and no number 2"):
        rc.film_race_drive(race.id, 1, league=league, track=2)


def test_a_race_keeps_the_organisers_own_track(run, league, tmp_path, monkeypatch):
    file = tmp_path / "home.npy"
    file.write_bytes(route_file(load_track("Oval_track")))
    race = rc.create_race("Home", league=league, laps=1, max_resets=1, track=["Oval_track", str(file)]).race
    assert race.tracks == ("Oval_track", "home")
    file.unlink()
    copy = rc.copy_race(race.id, "Again", league=league).race
    rc.enter_race(copy.id, run, league=league)
    (result,) = rc.judge_race(copy.id, league=league).results
    assert result.failure == ""
    assert [drive.track for drive in result.drives] == ["Oval_track", "home"]
    assert league_world("deepracer").shown(league / "races" / copy.id / result.drives[1].folder)["cars"]
    assert league_world("deepracer").road(League(league).track(copy.id, "home"))["closed"]
    monkeypatch.setattr(auditing, "DriveProcess", InProcess)
    assert not rc.audit_races(league=league).different


ARCHIVE = """\
Arn,Name,LaunchTime,TrackArn,MinimumLaps,RaceType,TimingMethod
a,One,1569888000000,x::track/Oval_track,1,TIME_TRIAL,BEST_LAP_TIME
b,Two,1669888000000,x::track/reinvent_base,1,TIME_TRIAL,BEST_LAP_TIME
"""


def test_aws_races_on_the_track_stand_beside_the_board_without_names(league, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "leaderboards.csv").write_text(ARCHIVE)
    (tmp_path / "a/FINAL.csv").write_text("Alias,Rank,RankingScore\nMia,1,7000\nJun,2,9000\n")
    race = rc.create_race("Club", league=league, **SHORT).race
    (row,) = league_world("deepracer").history(race, [8.0, None], tmp_path)
    assert (row["race"], row["winner_seconds"], row["own_seconds"], row["own_rank"]) == ("One", 7.0, 8.0, 2)
    assert "Mia" not in str(row)


def test_an_archive_of_aws_and_one_of_a_run_enter_as_a_run_does(run, league, tmp_path, here):
    race = rc.create_race("Old cars", league=league, **SHORT).race
    export_car(run, "car", None, tmp_path / "old.tar.gz", False)
    shutil.make_archive(str(tmp_path / "mine"), "gztar", run.parent, run.name)
    for source in (tmp_path / "old.tar.gz", tmp_path / "mine.tar.gz"):
        entry = rc.enter_race(race.id, source, league=league).entry
        kept = league / "races" / race.id / f"entries/{entry.number:05}/model"
        assert not list(kept.rglob("reward_function.py"))
    results = rc.judge_race(race.id, league=league).results
    assert [one.failure for one in results] == ["", ""]


REFUSED = {
    "speed": ({"max_speed": 0.5}, "commands .* m/s; expected at most 0.5 m/s"),
    "sensor": ({"sensors": ["STEREO_CAMERAS"]}, "has the sensor FRONT_FACING_CAMERA; expected one of STEREO_CAMERAS"),
    "several": ({"max_actions": 3, "generations": ["v4"]}, "2 faults:"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_car_that_the_rules_forbid_is_refused_with_the_reason_and_leaves_nothing(run, league, case):
    rules, reason = REFUSED[case]
    race = rc.create_race("Strict", league=league, **SHORT, **rules).race
    with pytest.raises(UserInputError, match=reason):
        rc.enter_race(race.id, run, league=league)
    assert [path.name for path in (league / "races" / race.id).iterdir() if path.name.startswith(".")] == []
    assert not rc.show_board(race.id, league=league).board.rows


def test_a_policy_with_code_of_its_own_is_refused_and_its_code_is_not_run(run, league, tmp_path):
    place = tmp_path / "own"
    shutil.copytree(run, place)
    weights, card = Checkpoints(place / "checkpoints").load_policy("best")
    network = dict(card["policy_spec"]["network"]) | {"encoder": "stolen:Encoder"}
    card["policy_spec"] = card["policy_spec"] | {"network": network}
    shutil.rmtree(place / "checkpoints")
    (place / "checkpoints").mkdir()
    Checkpoints(place / "checkpoints").save(1, 64, {k: np.asarray(v) for k, v in weights.items()}, card, best=True)
    (place / "code").mkdir()
    (place / "code" / "stolen.py").write_text("raise SystemExit('run')")
    race = rc.create_race("Club", league=league, **SHORT).race
    with pytest.raises(UserInputError, match="brings code of its own \\(stolen:Encoder\\)"):
        rc.enter_race(race.id, place, league=league)


def test_entries_end_with_the_deadline_and_the_last_submission(run, league):
    race = rc.create_race("Club", league=league, submissions=1, **SHORT).race
    rc.enter_race(race.id, run, racer="Mia", league=league)
    with pytest.raises(UserInputError, match="Mia has entered club 1 times; expected at most 1"):
        rc.enter_race(race.id, run, racer="Mia", league=league)
    rc.edit_race(race.id, closes="2020-01-01", league=league)
    with pytest.raises(UserInputError, match="club is closed"):
        rc.enter_race(race.id, run, racer="Bob", league=league)
    practice = rc.create_race("Practice", league=league, submissions=1, practice=True, **SHORT).race
    for number in (1, 2):
        assert rc.enter_race(practice.id, run, racer="Mia", league=league).entry.number == number


def test_a_reset_race_is_judged_again_and_keeps_the_old_results(run, league, here):
    race = rc.create_race("Club", league=league, **SHORT).race
    rc.enter_race(race.id, run, league=league)
    (before,) = rc.judge_race(race.id, league=league).results
    assert rc.reset_race(race.id, league=league).results == 1
    assert rc.show_board(race.id, league=league).board.waiting == 1
    (after,) = rc.judge_race(race.id, league=league).results
    assert after.drives == before.drives, "the same entry is driven on the same seed"
    assert len(list((league / "races/club/past").rglob("00001.json"))) == 1
    assert League(league).race("club").id == "club"
