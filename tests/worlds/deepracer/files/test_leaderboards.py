"""Leaderboards of the public archive, by made-up tables in its layouts of 2019, 2021 and 2024."""

from datetime import UTC, datetime

import pytest

from racecraft.worlds.deepracer.evaluation.history import own_score, placed
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.files.leaderboards import LeaderboardError, read_leaderboards

HEAD = "Rank,Arn,Name,Description,LaunchTime,TrackArn,MinimumLaps,RaceType,TimingMethod,RacingDivision"
ARN = "arn:aws:deepracer:::leaderboard/"
RACES = f"""\
1,{ARN}new,"Autumn, open",words,1725148800000,arn:aws:deepracer:us-east-1::track/Austin,3,TIME_TRIAL,TOTAL_TIME,OPEN
2,{ARN}old,Spring,"many
lines",1556553600000,arn:aws:deepracer:us-east-1::track/reInvent2019_track,2,TIME_TRIAL,AVG_LAP_TIME,
3,{ARN}boxes,Boxes,,1620000000000,arn:aws:deepracer:us-east-1::track/Austin,3,OBJECT_AVOIDANCE,BEST_LAP_TIME,PRO
4,{ARN}gone,Gone,,1630000000000,arn:aws:deepracer:us-east-1::track/Austin,3,TIME_TRIAL,BEST_LAP_TIME,
"""
NEW = """\
Rank,Alias,SubmissionTime,LapCount,AvgLapTime,BestLapTime,TotalLapTime,AvgResets,SubmissionCount,RankingScore,UserId
2,b,1,3,11000.0,10900.0,33000.0,0.5,4,33000,x
1,a,1,3,10000.0,9500.0,30000.0,0.0,9,30000,y
3,c,1,0,,,,0.0,1,9223372036854775732,z
"""
OLD = """\
Alias,SubmissionTime,AvgLapTime,Rank,LeaderboardSubmissionStatusType,RankingScore,UserId
a,1,8000,1,SUCCESS,8000,x
"""
EARLIER = OLD.replace("8000", "9999")


@pytest.fixture
def archive(tmp_path):
    top = tmp_path / "raw_data" / "leaderboards"
    for arn, name, text in (
        ("new", "FINAL.csv", NEW), ("old", "FINAL.csv", OLD), ("old", "2019-05-01T00:00:00Z.csv", EARLIER),
        ("boxes", "2021-05-01T00:00:00Z.csv", EARLIER), ("boxes", "2021-05-02T00:00:00Z.csv", OLD),
    ):  # fmt: skip
        folder = top / f"{ARN}{arn}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (top / "leaderboards.csv").write_text(f"{HEAD}\n{RACES}")
    return tmp_path


def test_races_come_by_date_with_what_the_years_have_in_common(archive):
    boards = read_leaderboards(archive)
    assert [board.name for board in boards] == ["Spring", "Boxes", "Gone", "Autumn, open"]
    old, boxes, gone, new = boards
    assert (old.track, old.timing, old.laps, old.launched.year) == ("reInvent2019_track", "AVG_LAP_TIME", 2, 2019)
    assert (new.division, new.laps, boxes.laps) == ("OPEN", 3, 1)  # a best lap is one lap, whatever had to be driven
    assert [(e.rank, e.alias, e.score_seconds, e.best_lap_seconds) for e in new.entries()] == [
        (1, "a", 30.0, 9.5), (2, "b", 33.0, 10.9)
    ]  # fmt: skip
    assert old.entries()[0].score_seconds == boxes.entries()[0].score_seconds == 8.0  # the last state counts
    assert old.entries()[0].best_lap_seconds is None
    assert gone.entries() == []
    assert len(read_leaderboards(archive / "raw_data" / "leaderboards")) == 4


def laps(*seconds):
    return LapReport(tuple(Lap(0.0, 100.0, one, "lap_complete" if one else "off_track", 100) for one in seconds))


def test_own_laps_are_timed_as_the_race_was(archive):
    old, boxes, _, new = read_leaderboards(archive)
    driven = laps(12.0, None, 11.0, 10.0, 10.5, 13.0)
    assert own_score(driven, new) == pytest.approx(31.5)
    assert own_score(driven, old) == pytest.approx(10.25)
    assert own_score(driven, boxes) == 10.0
    assert own_score(laps(10.0, None, 10.0, 10.0), new) is None
    place = placed(driven, new)
    assert (place.rank, place.racers, place.winner.alias, place.median_seconds) == (2, 2, "a", 31.5)
    assert placed(laps(9.0, 9.0, 9.0), new).rank == 1
    assert placed(laps(50.0, 50.0, 50.0), new).rank == 3
    assert placed(driven, boxes) is None  # another kind of race
    assert placed(driven, boxes, "OBJECT_AVOIDANCE").rank == 2


WRONG = {
    "a rank that is none": ("new/FINAL.csv", NEW.replace("\n1,a", "\nfirst,a"), "FINAL.csv:3: Rank is 'first'"),
    "a row cut short": ("new/FINAL.csv", NEW + "4,d\n", "FINAL.csv:5: more or fewer cells"),
    "a timing nobody knows": ("", f"{HEAD}\n{RACES.replace('TOTAL_TIME', 'LUCK')}", "TimingMethod is 'LUCK'"),
    "a date that is none": ("", f"{HEAD}\n{RACES.replace('1725148800000', '1e300')}", "LaunchTime is 1e[+]300"),
    "no races": ("", f"{HEAD}\n", "names no race"),
}


def read_all(folder):
    return [board.entries() for board in read_leaderboards(folder)]


@pytest.mark.parametrize("what", WRONG)
def test_wrong_files_are_letters(archive, what):
    place, text, letter = WRONG[what]
    top = archive / "raw_data" / "leaderboards"
    path = top / f"{ARN}{place}" if place else top / "leaderboards.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(LeaderboardError, match=letter):
        read_all(archive)


def test_a_folder_of_something_else_is_a_letter(tmp_path):
    with pytest.raises(LeaderboardError, match=r"holds no leaderboards.csv; expected a copy of the archive"):
        read_leaderboards(tmp_path)
    with pytest.raises(LeaderboardError, match="no such folder"):
        read_leaderboards(tmp_path / "nowhere")


def test_times_are_seconds_and_what_a_table_does_not_tell_is_none(archive):
    old, _, _, new = read_leaderboards(archive)
    assert new.launched == datetime(2024, 9, 1, tzinfo=UTC)
    assert (new.arn, new.race_type, old.division) == (f"{ARN}new", "TIME_TRIAL", "")
    assert [(one.laps, one.submissions, one.resets) for one in new.entries()] == [(3, 9, 0.0), (3, 4, 0.5)]
    (only,) = old.entries()
    assert (only.laps, only.submissions, only.resets, only.alias) == (None, None, None, "a")


def raced(tmp_path, rows):
    """Return a race of the rows Rank, Alias, AvgLapTime, RankingScore."""
    folder = tmp_path / f"{ARN}x"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "FINAL.csv").write_text("\n".join(["Rank,Alias,AvgLapTime,RankingScore", *rows]) + "\n")
    race = f"1,{ARN}x,N,,1000,a::track/T,,TIME_TRIAL,TOTAL_TIME,"
    (tmp_path / "leaderboards.csv").write_text(f"{HEAD}\n{race}\n")
    (board,) = read_leaderboards(tmp_path)
    return board


def test_who_never_finished_has_no_place(tmp_path):
    """A score beyond 10^12 ms, some 30 years, stands for none; where there is no score, the mean lap is it."""
    rows = ["1,a,,1000000000000", "2,b,,1000000000001", "3,c,,0", "4,d,5000,", "5,e,,", ",f,,7000", "7,g,6000,8000"]
    board = raced(tmp_path, rows)
    assert [(one.rank, one.alias, one.score_seconds) for one in board.entries()] == [
        (1, "a", 1e9), (4, "d", 5.0), (7, "g", 8.0)
    ]  # fmt: skip
    assert board.laps == 1, "where it is not told how many laps had to be driven, it was one"


@pytest.mark.parametrize(
    ("row", "words"),
    [("1,a,,-1", "RankingScore is '-1'; expected a number, 0 or more"), ('1,"a"b,,5', "cannot be read")],
)
def test_a_damaged_row_is_named_with_its_line(tmp_path, row, words):
    with pytest.raises(LeaderboardError, match=words) as caught:
        raced(tmp_path, ["1,a,,5", row]).entries()
    assert caught.value.line == (None if "read" in words else 3)


def test_of_several_states_the_latest_counts(tmp_path):
    board = raced(tmp_path, [])
    (tmp_path / f"{ARN}x" / "FINAL.csv").unlink()
    for day, score in ((3, 9000), (1, 7000), (2, 8000)):
        (tmp_path / f"{ARN}x" / f"2021-05-0{day}.csv").write_text(f"Rank,RankingScore\n1,{score}\n")
    (board,) = read_leaderboards(tmp_path)
    assert [(one.alias, one.score_seconds) for one in board.entries()] == [("", 9.0)]


def test_the_copy_may_be_named_by_any_of_three_folders(tmp_path):
    for place in ("x", "y/leaderboards", "z/raw_data/leaderboards"):
        (tmp_path / place).mkdir(parents=True)
        raced(tmp_path / place, ["1,a,,5"])
        assert [len(board.entries()) for board in read_leaderboards(tmp_path / place[0])] == [1]
