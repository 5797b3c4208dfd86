"""Damaged files: what is wrong is named by file and line, and the rest is read."""

import math

import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.logs import read


def spoiled(tmp_path, change):
    """Write two iterations, the first with its lines changed; return its path, and what was read of both."""
    folder = tmp_path / "training-simtrace"
    lines = makers.csv_text(makers.iteration(range(3))).split("\n")
    folder.mkdir()
    (folder / "0-iteration.csv").write_text("\n".join(change(lines)))
    makers.write(folder / "1-iteration.csv", makers.iteration(range(3, 6)))
    return folder / "0-iteration.csv", read(tmp_path)


def test_a_torn_last_row_is_named_and_the_rest_is_read(tmp_path):
    path, logs = spoiled(tmp_path, lambda lines: [*lines[:-2], lines[-2][:25]])
    assert logs.ticks.collect().height == 2 * 36 - 1
    assert [(one.file, one.line) for one in logs.damaged] == [(str(path), 37)]
    assert "values where 17 are expected" in logs.damaged[0].what


def test_a_value_that_is_none_is_named_with_its_column(tmp_path):
    def change(lines):
        cells = lines[4].split(",")
        cells[2] = "east"
        return [*lines[:4], ",".join(cells), *lines[5:]]

    path, logs = spoiled(tmp_path, change)
    assert str(logs.damaged[0]) == f"{path}:5: X is 'east'; the row was passed over"
    frame = logs.ticks.collect()
    assert frame.height == 71
    assert 5 not in frame.filter(pl.col("file") == 0)["line"].to_list()
    assert {4, 6} <= set(frame.filter(pl.col("file") == 0)["line"].to_list())


def test_a_pose_that_is_not_a_number_is_damage(tmp_path):
    def change(lines):
        cells = lines[7].split(",")
        cells[4] = "nan"
        return [*lines[:7], ",".join(cells), *lines[8:]]

    path, logs = spoiled(tmp_path, change)
    assert str(logs.damaged[0]) == f"{path}:8: yaw is 'nan'; the row was passed over"


def test_an_empty_file_and_one_that_is_no_trace_are_named(tmp_path):
    path, logs = spoiled(tmp_path, lambda lines: [])
    assert str(logs.damaged[0]) == f"{path}: the file is empty"
    assert logs.ticks.collect().height == 36
    (tmp_path / "b").mkdir()
    path, logs = spoiled(tmp_path / "b", lambda lines: ["a,b,c", "1,2,3"])
    assert str(logs.damaged[0]).startswith(f"{path}:1: no column episode, steps, X")


def test_a_file_with_its_header_alone_is_no_damage(tmp_path):
    _, logs = spoiled(tmp_path, lambda lines: [lines[0], ""])
    assert (logs.ticks.collect().height, logs.damaged) == (36, ())


def test_files_of_several_versions_are_one_table(tmp_path):
    def old(lines):
        return [",".join(line.split(",")[:15]) if line else line for line in lines]

    _, logs = spoiled(tmp_path, old)
    frame = logs.ticks.collect()
    assert (frame.height, logs.damaged) == (72, ())
    assert frame.filter(pl.col("iteration") == 0)["status"].null_count() == 36
    assert frame.filter(pl.col("iteration") == 1)["status"].null_count() == 0
    assert frame["unique_episode"].n_unique() == 6


@pytest.mark.parametrize("odd", [0, 2])
def test_a_trace_among_many_is_read_by_its_own_header_wherever_it_stands(tmp_path, odd):
    makers.drfc(tmp_path, iterations=4)
    alike = read(tmp_path).ticks.collect()
    path = tmp_path / "training-simtrace" / f"{odd}-iteration.csv"
    head, *rows = path.read_text().splitlines()
    turned = [",".join(reversed(line.split(","))) for line in (head, *rows)]
    path.write_text("\n".join(turned) + "\n")
    assert read(tmp_path).ticks.collect().equals(alike)
    path.write_text("\n".join([head.upper(), *rows]) + "\n")
    assert read(tmp_path).ticks.collect().equals(alike)
    path.write_text(head[:20])
    logs = read(tmp_path)
    assert logs.ticks.collect().height == alike.filter(pl.col("iteration") != odd).height
    assert [str(one.file) for one in logs.damaged] == [str(path)]


def test_angles_and_progress_are_ours_to_the_last_bit(tmp_path):
    """8.1818 % is 0.081818 of a lap, not 0.08181800000000002; so it is in a row beside a damaged one."""
    path = tmp_path / "0-iteration.csv"
    head, *rows = makers.csv_text(makers.iteration(range(2))).splitlines()
    place = {name: head.split(",").index(name) for name in ("yaw", "steer", "progress")}
    told = {"yaw": "-34.27517943144103", "steer": "30.0", "progress": "8.1818"}
    rows = [row.split(",") for row in rows]
    for row in rows:
        for name, value in told.items():
            row[place[name]] = value
    rows[3][place["yaw"]] = "north"
    rows[5][place["yaw"]] = "-3.427517943144103e1"
    path.write_text("\n".join([head, *(",".join(row) for row in rows)]) + "\n")
    ticks = read(path).ticks.select("yaw_rad", "steering_rad", "progress_share").collect()
    assert ticks.height == len(rows) - 1
    assert ticks.unique().row(0) == (math.radians(-34.27517943144103), math.radians(30.0), 0.081818)
    assert ticks.n_unique() == 1


def test_a_clock_that_jumps_is_named_and_its_rows_are_kept(tmp_path):
    columns = makers.iteration(range(2))
    columns["tstamp"][5:12] -= 100.0
    columns["tstamp"][18:24] += 60.0
    path = makers.write(tmp_path / "training-simtrace" / "0-iteration.csv", columns)
    logs = read(tmp_path)
    assert [(one.file, one.line) for one in logs.damaged] == [(str(path), 7), (str(path), 20)]
    assert "runs back by 99.933 s" in logs.damaged[0].what
    assert "leaps by 60.067 s" in logs.damaged[1].what
    assert logs.ticks.collect().height == 24


def test_many_bad_rows_are_counted_after_the_first_twenty(tmp_path):
    _, logs = spoiled(tmp_path, lambda lines: [lines[0], *["x"] * 30, *lines[1:]])
    assert len(logs.damaged) == 21
    assert logs.damaged[-1].what == "10 more rows were passed over"
    assert logs.ticks.collect().height == 72


def test_a_bad_line_in_a_log_is_named_by_its_line_in_the_log(tmp_path):
    lines = makers.log_text(makers.iteration(range(2))).splitlines()
    lines[6] = lines[6][:40]
    (tmp_path / "a.log").write_text("\n".join([*lines[:3], "", 'an "odd" line', "", *lines[3:]]))
    logs = read(tmp_path / "a.log")
    assert [(one.file, one.line) for one in logs.damaged] == [(str(tmp_path / "a.log"), 10)]
    assert logs.ticks.collect().height == 23


def test_metrics_that_are_no_json_are_named_and_the_traces_read(tmp_path):
    makers.drfc(tmp_path)
    (tmp_path / "metrics").mkdir()
    (tmp_path / "metrics" / "TrainingMetrics.json").write_text('{"metrics": [')
    logs = read(tmp_path)
    assert logs.ticks.collect().height == 72
    assert [one.what.startswith("no valid JSON") for one in logs.damaged] == [True]
