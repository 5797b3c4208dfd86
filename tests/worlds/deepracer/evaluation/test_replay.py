"""The fidelity report: by twin on recorded races, by law on races of our own, and on what users bring by mistake."""

import math
from pathlib import Path

import numpy as np
import pytest
from tests.reference import DATA, HAS_ALL, LARGE

from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.worlds.deepracer.env.kernels.vehicle import drive
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, FRONT_WHEELS_M, PROFILES, REAR_WHEELS_M, TICK_SECONDS
from racecraft.worlds.deepracer.evaluation.open_loop import drive_open_loop
from racecraft.worlds.deepracer.evaluation.recompute import recompute
from racecraft.worlds.deepracer.evaluation.replay_picture import draw_replay
from racecraft.worlds.deepracer.evaluation.replay_report import replay
from racecraft.worlds.deepracer.files.sim_trace import SimTrace, write_sim_trace
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TRACK = load_track("reinvent_base")


def told_by(driver, episodes=2, ticks=60, car="v4", status=True, start_m=2.0):
    """Return a trace of our own: a car that obeys `driver(tick)` (rad, m/s), each episode from rest at the start."""
    rows = []
    steering = 0.0
    for episode in range(episodes):
        x, y, yaw = TRACK.pose_at(start_m)
        speed, old = 0.0, (0.0, 0.0)
        for tick in range(ticks):
            command = driver(tick)
            rows.append((episode, tick + 1.0, x, y, yaw, *command, episode * (ticks + 1) + tick))
            held = tick == 0
            to = (0.0, 0.0) if held else command
            moved = drive(PROFILES[car], x, y, yaw, speed, steering, *old, *to)
            old = to
            steering = moved[4]
            if not held:
                x, y, yaw, speed = moved[:4]
        steering = drive(PROFILES[car], x, y, yaw, speed, steering, *old, *command)[4]  # until it stands again
    return trace_of(np.array(rows), ticks, status)


def trace_of(rows, ticks, status):
    """Return rows (episode, steps, x, y, yaw, steering, speed, clock) as a trace with the figures of our geometry."""
    episode, steps, x, y, yaw, steering, speed, clock = rows.T
    front = np.column_stack([x + FRONT_POINT_M * np.cos(yaw), y + FRONT_POINT_M * np.sin(yaw)])
    found = TRACK.locate(front)
    share = found.arc / TRACK.length
    columns = {
        "episode": episode.astype(np.int64),
        "steps": steps,
        "X": front[:, 0],
        "Y": front[:, 1],
        "yaw": np.degrees(yaw),
        "steer": np.degrees(steering),
        "throttle": speed,
        "action": np.full(len(rows), 3),
        "reward": np.ones(len(rows)),
        "done": steps == ticks,
        "all_wheels_on_track": all_wheels_on(x, y, yaw),
        "progress": 100.0 * np.mod(share - 0.1, 1.0),
        "closest_waypoint": found.nearer_waypoint,
        "track_len": np.full(len(rows), TRACK.length),
        "tstamp": clock * TICK_SECONDS,
    }
    if status:
        columns["episode_status"] = np.where(steps == 1, "prepare", "in_progress")
    return columns


def all_wheels_on(x, y, yaw):
    on = np.ones(len(x), bool)
    for ahead, side in (REAR_WHEELS_M, FRONT_WHEELS_M):
        for left in (side, -side):
            wheel_x = x + ahead * np.cos(yaw) - left * np.sin(yaw)
            on &= TRACK.contains(np.column_stack([wheel_x, y + ahead * np.sin(yaw) + left * np.cos(yaw)]))
    return on


def straight_on(tick):
    return 0.02 * math.cos(tick / 5) - 0.0067, 0.5 if tick < 30 else 0.7


@pytest.fixture
def trace_file(tmp_path):
    """Return a function that writes columns to a trace file, some of them changed."""

    def write(name="0-iteration.csv", drop=(), **changes):
        columns = {**told_by(straight_on), **changes}
        write_sim_trace(tmp_path / name, {key: values for key, values in columns.items() if key not in drop})
        return tmp_path / name

    return write


RECORDED = {
    "console-2022": ("console-2022/sim-trace/training/training-simtrace", "reinvent_base", "v4", 44247),
    "drfc-1-worker": ("drfc-1-worker/training-simtrace", "reinvent_base", "v4", 39392),
    "drfc-evaluation": ("drfc-1-worker/evaluation-20220709200242", "reinvent_base", "v4", 650),
    "droa-2026-discrete": ("droa-2026-discrete", "Spain_track", "v6", 846),
    "droa-2026-continuous": ("droa-2026-continuous", "reInvent2019_wide_cw", "v6", 3893),
}


@pytest.mark.parametrize("name", RECORDED)
def test_a_recorded_race_is_the_same_race_and_the_same_car(name):
    if name == "console-2022" and not HAS_ALL:
        pytest.skip(LARGE)
    folder, track, car, rows = RECORDED[name]
    report = replay([DATA / "traces" / folder], DATA / "tracks" / f"{track}.npy").as_dictionary()
    assert report["car"] == car, "the car that strays less is the one that was recorded"
    assert report["rows"] == rows
    assert report["progress_mismatches"] == report["closest_waypoint_mismatches"] == 0
    assert report["all_wheels_mismatches"] <= 0.002 * rows
    assert report["off_track_mismatches"] <= 0.002 * rows
    assert report["open_loop_position_m"]["0.5s"]["median"] <= 0.06
    assert report["open_loop_position_m"]["1s"]["median"] <= 0.11
    assert all(len(file["worst_windows"]) == 5 for file in report["files"])
    assert report["damaged_rows"] == []
    assert (report["same_track"], report["same_car"], report["direction"]) == (True, True, "forward")
    assert report["waypoints"] == ("as_filed" if track == "Spain_track" else None)
    assert len(report["notes"]) == (track == "Spain_track")
    assert min(report["cars_tried_m"], key=report["cars_tried_m"].get) == car
    assert set(report["cars_tried_m"]) == {"v4", "v5-classic", "v6"}


def test_the_textbook_bicycle_is_found_out():
    folder, track, _, _ = RECORDED["droa-2026-continuous"]
    report = replay([DATA / "traces" / folder], DATA / "tracks" / f"{track}.npy", "kinematic").as_dictionary()
    assert report["open_loop_position_m"]["1s"]["median"] > 0.4


def test_the_catalogues_curve_is_announced_and_lies_within_a_tenth_of_a_point():
    path = DATA / "traces" / RECORDED["drfc-evaluation"][0]
    report = replay([path], "reinvent_base")
    assert "smooth curve" in report.notes()[0]
    file = report.files[0]
    assert np.abs(file.retold.progress - file.trace.columns["progress"]).max() < 0.1


def test_a_race_of_our_own_is_driven_again_to_the_last_bit(trace_file):
    """Every command since the row of the start is known, so the windows must close entirely, launch included."""
    report = replay([trace_file()], "reinvent_base", "v4").as_dictionary()
    assert report["progress_mismatches"] == report["closest_waypoint_mismatches"] == 0
    assert report["all_wheels_mismatches"] == report["off_track_mismatches"] == 0
    assert report["windows"] == {"0.5s": 2 * 11, "1s": 2 * 9}  # 59 in-run rows: from 1, 6 .. 51; to 41
    assert report["open_loop_position_m"]["1s"]["p90"] < 1e-5
    assert report["open_loop_yaw_deg"]["1s"]["p90"] < 1e-3


def test_a_clocked_car_follows_the_stamps():
    """A row's command acts as long as its stamp lies behind the stamp before: stretch them and the car goes further."""
    columns = told_by(straight_on, car="v6")
    trace = SimTrace({**columns, "tstamp": columns["tstamp"] * 1.2})
    retold = recompute(trace, TRACK)
    plain, clocked = (drive_open_loop(trace, retold, "v6", clocked=clocked) for clocked in (False, True))
    assert np.nanmax(plain.position_m["1s"]) < 1e-9
    row = np.flatnonzero(np.isfinite(clocked.position_m["1s"]))[3]
    length = [np.nansum(np.hypot(*np.diff(w.paths[row, :16, :2], axis=0).T)) for w in (plain, clocked)]
    assert length[1] / length[0] == pytest.approx(1.2, abs=0.02)


def test_the_start_is_what_most_rows_agree_on():
    """Three rows of sixty tell another progress; only they are wrong."""
    columns = told_by(straight_on, episodes=1)
    columns["progress"][[5, 6, 40]] += 3.0
    retold = recompute(SimTrace(columns), TRACK)
    assert np.flatnonzero(retold.progress_wrong).tolist() == [5, 6, 40]


def test_a_lap_across_the_start_line_is_told_as_the_original_tells_it():
    columns = told_by(straight_on, episodes=1, ticks=90, start_m=TRACK.length - 1.0)
    start = TRACK.locate(np.column_stack([columns["X"], columns["Y"]])).arc[0] / TRACK.length - 0.0079
    share = TRACK.locate(np.column_stack([columns["X"], columns["Y"]])).arc / TRACK.length
    columns["progress"] = 100.0 * np.mod(share - start, 1.0)
    assert columns["progress"].max() < 50.0, "the drive crosses the line once"
    assert (np.diff(share) < -0.5).any()
    assert not recompute(SimTrace(columns), TRACK).progress_wrong.any()


def test_an_episode_driven_backwards_is_recognised():
    columns = told_by(straight_on, episodes=1)
    back = TRACK.reversed()
    found = back.locate(np.column_stack([columns["X"], columns["Y"]]))
    share = found.arc / back.length  # falls: this car has turned round; it stood at 30 % when it did
    columns["progress"] = 100.0 * np.mod(share - share[0] + 0.3, 1.0)
    columns["closest_waypoint"] = found.nearer_waypoint
    retold = recompute(SimTrace(columns), TRACK)
    assert retold.reversed.all()
    assert not retold.progress_wrong.any()
    assert not retold.waypoint_wrong.any()


def test_progress_that_fits_neither_direction_turns_no_car_round():
    """A column of any numbers lies about as far from what one direction tells as from what the other does."""
    columns = told_by(straight_on, episodes=1)
    columns["progress"] = np.random.default_rng(2).uniform(0.0, 100.0, len(columns["progress"]))
    retold = recompute(SimTrace(columns), TRACK)
    assert retold.progress_wrong.mean() > 0.9
    assert not retold.reversed.any()


def test_repeated_rows_of_a_route_file_may_be_counted(tmp_path, trace_file):
    """The builds of 2026 number a repeated row: every waypoint behind it is one further on."""
    rows = np.insert(TRACK.rows, 10, TRACK.rows[9], axis=0)
    np.save(tmp_path / "twice.npy", rows)
    waypoints = told_by(straight_on)["closest_waypoint"]
    assert waypoints.min() > 10
    for counted in (waypoints, waypoints + 1):
        report = replay([trace_file(closest_waypoint=counted)], tmp_path / "twice.npy").as_dictionary()
        assert report["closest_waypoint_mismatches"] == 0


@pytest.mark.parametrize("drop", [(), ("wall_clock", "obstacle_crash_counter"), ("episode_status", "pause_duration")])
def test_fifteen_to_nineteen_columns_are_read(trace_file, drop):
    others = {"pause_duration": np.zeros(120), "obstacle_crash_counter": np.zeros(120), "wall_clock": np.zeros(120)}
    report = replay([trace_file(drop=drop, **others)], "reinvent_base", "v4").as_dictionary()
    assert report["progress_mismatches"] == 0
    assert report["open_loop_position_m"]["1s"]["p90"] < 1e-5
    assert (report["off_track_mismatches"] is None) == ("episode_status" in drop)


def test_a_continuous_action_drives_as_well(trace_file):
    report = replay([trace_file(action=np.full(120, -1))], "reinvent_base", "v4").as_dictionary()
    assert report["open_loop_position_m"]["1s"]["p90"] < 1e-5


def test_several_workers_are_told_one_by_one(tmp_path, trace_file):
    """Two workers count the same episodes; a folder brings all of its iterations."""
    for worker in ("0", "1"):
        (tmp_path / worker / "training-simtrace").mkdir(parents=True)
        trace_file(f"{worker}/training-simtrace/0-iteration.csv")
    report = replay([tmp_path], "reinvent_base", "v4")
    assert [Path(file.name).parts[-3] for file in report.files] == ["0", "1"]
    assert report.as_dictionary()["episodes"] == 4


def test_the_picture_shows_both_paths(tmp_path, trace_file):
    report = replay([trace_file()], "reinvent_base", "v4")
    draw_replay(report, tmp_path / "replay.png")
    assert (tmp_path / "replay.png").read_bytes().startswith(b"\x89PNG")


def damaged(path, change):
    text = path.read_text().splitlines(keepends=True)
    path.write_text("".join(change(text)))
    return path


def swap(path, old, new):
    path.write_text(path.read_text().replace(old, new))


def test_damaged_rows_are_passed_over_and_named(trace_file):
    path = damaged(trace_file(), lambda lines: [*lines[:50], "0,50,oops\n", *lines[51:]])
    report = replay([path], "reinvent_base", "v4").as_dictionary()
    assert report["rows"] == 119
    assert ":51:" in report["damaged_rows"][0]
    assert report["progress_mismatches"] == 0
    assert report["open_loop_position_m"]["1s"]["median"] < 1e-5


def test_numbers_that_are_none_are_passed_over_and_named(trace_file):
    x = told_by(straight_on)["X"]
    x[[7, 8]] = np.nan, np.inf
    report = replay([trace_file(X=x)], "reinvent_base", "v4").as_dictionary()
    assert report["rows"] == 118
    assert "X is 'nan'" in report["damaged_rows"][0]
    assert math.isfinite(report["open_loop_position_m"]["1s"]["p90"])


MISTAKES = {
    "no such file": (lambda path: path.unlink(), LogError, "no such file"),
    "empty": (lambda path: path.write_text(""), LogError, "the file is empty"),
    "only a header": (lambda path: damaged(path, lambda lines: lines[:1]), LogError, "no rows"),
    "a column is missing": (lambda path: swap(path, ",yaw,", ",jaw,"), LogError, "yaw"),
    "never driven": (lambda path: swap(path, "in_progress", "pause"), LogError, "driven"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_answered_by_a_letter(trace_file, mistake):
    spoil, error, words = MISTAKES[mistake]
    path = trace_file()
    spoil(path)
    with pytest.raises(error, match=words) as letter:
        replay([path], "reinvent_base", "v4")
    assert str(path) in str(letter.value)


def test_another_track_is_named_as_such(trace_file):
    with pytest.raises(InputFileError, match=r"elsewhere on Oval_track.*17\.71 m.*reinvent_base"):
        replay([trace_file()], "Oval_track")


def test_an_unknown_track_car_or_folder_is_refused(tmp_path, trace_file):
    with pytest.raises(UserInputError, match="reinvent_base"):
        replay([trace_file()], "reinvent_bace")
    with pytest.raises(UserInputError, match="Did you mean 'v4'"):
        replay([trace_file()], "reinvent_base", "v44")
    (tmp_path / "nothing").mkdir()
    with pytest.raises(LogError, match="no log was found"):
        replay([tmp_path / "nothing"], "reinvent_base")


def test_too_short_a_race_is_counted_but_not_driven(trace_file):
    path = damaged(trace_file(), lambda lines: lines[:7])
    report = replay([path], "reinvent_base").as_dictionary()
    assert report["rows"] == 6
    assert report["windows"] == {"0.5s": 0, "1s": 0}
    assert report["open_loop_position_m"]["1s"] == {"median": None, "p90": None}
