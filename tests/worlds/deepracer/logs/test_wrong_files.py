"""Files that are wrong in ways which somebody's disk brings about: named, and the rest is read."""

import os

import pytest
from tests.worlds.deepracer.logs.makers import csv_text, drfc, episode, iteration, write

from racecraft.worlds.deepracer.analysis.logs import reward_heat_map, stability
from racecraft.worlds.deepracer.files.simulation_log import trace_lines
from racecraft.worlds.deepracer.logs import LogError, read
from racecraft.worlds.deepracer.tracks.catalogue import load_track


def test_a_link_to_nothing_is_named_and_the_rest_is_read(tmp_path):
    drfc(tmp_path)
    whole = read(tmp_path).ticks.collect().height
    (tmp_path / "training-simtrace" / "2-iteration.csv").symlink_to(tmp_path / "gone.csv")
    (tmp_path / "training-sim.log").symlink_to(tmp_path / "gone.log")
    (tmp_path / "training_params.yaml").symlink_to(tmp_path / "gone.yaml")
    logs = read(tmp_path)
    assert logs.ticks.collect().height == whole
    assert [str(one).rsplit("/", 1)[1] for one in logs.damaged] == [
        "2-iteration.csv: cannot be read (No such file or directory); left out"
    ]
    assert "world" not in logs.about


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes here")
def test_a_pipe_is_no_log(tmp_path):
    os.mkfifo(tmp_path / "x.csv")
    with pytest.raises(LogError, match="a pipe or a device"):
        read(tmp_path / "x.csv")


def test_a_number_that_no_iteration_has_makes_no_trace(tmp_path):
    write(tmp_path / "training-simtrace" / f"{10**20}-iteration.csv", iteration(range(2)))
    with pytest.raises(LogError, match="no log was found there"):
        read(tmp_path)
    write(tmp_path / "training-simtrace" / "0-iteration.csv", iteration(range(2)))
    assert read(tmp_path).ticks.collect()["iteration"].unique().to_list() == [0]


def test_a_log_of_several_versions_loses_no_row(tmp_path):
    rows = trace_lines(iteration(range(6)))
    fields = rows[0].count(",") + 1
    rows[10:20] = [",".join(row.split(",")[:15]) for row in rows[10:20]]
    rows[40:50] = [",".join(row.split(",")[:17]) for row in rows[40:50]]
    rows[55] = rows[55].rsplit(",", 5)[0]
    path = tmp_path / "training-sim-1.log"
    path.write_text("\n".join(rows) + "\n")
    logs = read(path)
    ticks = logs.ticks.collect()
    assert fields == 19
    assert ticks["line"].to_list() == [line for line in range(1, len(rows) + 1) if line != 56]
    assert [one.line for one in logs.damaged] == [56]
    assert ticks["status"].is_null().arg_true().to_list() == list(range(10, 20))
    assert ticks["pause_s"].is_null().arg_true().to_list() == list(range(10, 20))
    assert ticks["obstacle_crashes"].is_null().arg_true().to_list() == [*range(10, 20), *range(40, 50)]
    assert read(path).ticks.select("wall_clock_s", "x_m").collect().equals(ticks.select("wall_clock_s", "x_m"))


def test_a_place_out_of_this_world_is_no_reason_not_to_draw_the_others(tmp_path):
    columns = iteration(range(3))
    columns["X"][5], columns["Y"][7] = 9e14, -9e14
    write(tmp_path / "0-iteration.csv", columns)
    ticks = read(tmp_path).ticks.collect()
    assert reward_heat_map(ticks, load_track("reinvent_base")).figure is not None


@pytest.mark.filterwarnings("error")
def test_the_time_between_the_steps_of_one_step_is_drawn(tmp_path):
    (tmp_path / "0-iteration.csv").write_text("\n".join(csv_text(episode(0)).split("\n")[:2]))
    assert stability(read(tmp_path).ticks).figure is not None


@pytest.mark.parametrize("wrong", ["-1e308", "1000000000000000.5"])
@pytest.mark.parametrize("name", ["X", "pause_duration"])
def test_a_number_that_no_drive_has_is_named_and_its_row_left_out(tmp_path, wrong, name):
    path = spoilt(tmp_path, name, wrong)
    logs = read(path)
    assert logs.ticks.select("tick").collect().height == 35, "whether or not the column is asked for"
    assert [str(one) for one in logs.damaged] == [f"{path}:6: {name} is {wrong!r}; the row was passed over"]
    assert logs.ticks.collect().height == 35


@pytest.mark.parametrize("name", ["episode", "closest_waypoint"])
def test_a_count_that_no_drive_comes_to_is_named_and_its_row_left_out(tmp_path, name):
    path = spoilt(tmp_path, name, "2147483647")
    logs = read(path)
    assert logs.ticks.collect().height == 35
    assert [one.line for one in logs.damaged] == [6]


def spoilt(tmp_path, name, value):
    """Write a trace with one value changed, on line 6; return its path."""
    lines = csv_text(iteration(range(3))).split("\n")
    cells = lines[5].split(",")
    cells[lines[0].split(",").index(name)] = value
    path = tmp_path / "0-iteration.csv"
    path.write_text("\n".join([*lines[:5], ",".join(cells), *lines[6:]]))
    return path


def as_excel(text, sign=";", comma=True):
    """Return a trace as Excel saves it: TRUE for True, columns parted by a sign, decimal commas."""
    text = text.replace("True", "TRUE").replace("False", "FALSE").replace(",", sign)
    return (text.replace(".", ",") if comma else text).replace("\n", "\r\n")


@pytest.mark.parametrize(
    ("sign", "comma", "encoding", "words"),
    [
        (";", True, "utf-8-sig", "parts its columns by semicolons and writes decimal commas"),
        ("\t", False, "utf-16", "is UTF-16 text and parts its columns by tabs"),
    ],
)
def test_a_trace_that_a_spreadsheet_saved_is_read_and_named(tmp_path, sign, comma, encoding, words):
    text = csv_text(iteration(range(3)))
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    (tmp_path / "a" / "0-iteration.csv").write_text(text)
    path = tmp_path / "b" / "0-iteration.csv"
    path.write_bytes(as_excel(text, sign, comma).encode(encoding))
    saved = read(path)
    assert saved.ticks.collect().equals(read(tmp_path / "a").ticks.collect())
    assert [str(one) for one in saved.damaged] == [
        f"{path}: {words}, as a spreadsheet saves it; read as such (save it as `CSV (comma delimited)` where the "
        "decimal point is a point, to be sure)"
    ]


def test_a_spreadsheet_s_row_with_signs_for_thousands_is_named(tmp_path):
    lines = as_excel(csv_text(iteration(range(3)))).split("\r\n")
    cells = lines[5].split(";")
    cells[2] = "1.234,5"
    path = tmp_path / "0-iteration.csv"
    path.write_text("\n".join([*lines[:5], ";".join(cells), *lines[6:]]))
    logs = read(path)
    assert logs.ticks.collect().height == 35
    assert [one.line for one in logs.damaged] == [None, 6]


def test_a_log_that_went_through_powershell_is_read(tmp_path):
    path = tmp_path / "training-sim-1.log"
    path.write_bytes("\r\n".join(trace_lines(iteration(range(3)))).encode("utf-16"))
    logs = read(path)
    assert logs.ticks.collect().height == 36
    assert ["UTF-16" in str(one) for one in logs.damaged] == [True]
