"""What a reader knows and what it must not take for granted: iterations, phases, repeated rows, compressed files."""

import gzip

import numpy as np
import polars as pl
import pytest

from racecraft.worlds.deepracer.files.simulation_log import episode_line, trace_lines
from racecraft.worlds.deepracer.logs import read

from . import makers


def phases(found):
    return set(found.ticks.collect()["phase"].cast(pl.String))


def test_iterations_are_counted_where_a_log_says_iteration_0_of_every_episode(tmp_path):
    """As all logs of DeepRacer for Cloud in log-guru's tests do; here 60 episodes, 20 an iteration."""
    columns = makers.iteration(range(60))
    lines = ["Using the following hyper-parameters", "{", '"num_episodes_between_training": 20', "}"]
    lines += [episode_line(0, k + 1, 1.0, 5, 0) for k in range(60)]
    (tmp_path / "robomaker.log").write_text("\n".join([*lines, *trace_lines(columns), ""]))
    ticks = read(tmp_path / "robomaker.log").ticks.collect()
    counts = ticks.group_by("iteration").agg(pl.col("episode").n_unique()).sort("iteration")
    assert counts.rows() == [(0, 20), (1, 20), (2, 20)]


def flying(numbers, reward=1.0):
    """Episodes of which none begins with a row in which the car is held, as in console logs of early 2021."""
    columns = makers.iteration(numbers, reward=reward)
    status = columns["episode_status"]
    columns["episode_status"] = np.where(status == "prepare", "in_progress", status)
    return columns


@pytest.mark.parametrize(("files", "phase"), [(1, "evaluation"), (2, "training")])
def test_several_loose_traces_are_a_training_whatever_their_first_laps_look_like(tmp_path, files, phase):
    for k in range(files):
        makers.write(tmp_path / f"{k}-iteration.csv", flying(range(3 * k, 3 * k + 3)))
    assert phases(read(tmp_path)) == {phase}


def test_more_laps_or_rewards_than_an_evaluation_has_are_a_trainings(tmp_path):
    for name, columns in (("many", flying(range(21))), ("paid", flying(range(3), reward=2.5))):
        makers.write(tmp_path / name / "0-iteration.csv", columns)
        assert phases(read(tmp_path / name)) == {"training"}, name


def test_a_trace_is_what_the_log_beside_it_is_called_and_is_counted_once(tmp_path):
    columns = makers.iteration(range(3))
    makers.write(tmp_path / "0-iteration.csv", columns)
    log = tmp_path / "evaluation-20250513043922-abc-robomaker.log"
    log.write_text(makers.log_text(columns))
    found = read(tmp_path)
    assert phases(found) == {"evaluation"}
    assert found.ticks.collect().height == len(columns["steps"])
    assert found.about["world"] == "reinvent_base", "what the log says beside its rows is kept"
    log.rename(tmp_path / "training-20250513043922-abc-robomaker.log")
    assert phases(read(tmp_path)) == {"training"}


def test_a_compressed_trace_is_read_and_a_damaged_one_is_named(tmp_path):
    plain = makers.write(tmp_path / "model" / "training-simtrace" / "0-iteration.csv", makers.iteration(range(3)))
    expected = read(tmp_path / "model").ticks.collect().drop("file")
    packed = plain.with_name("0-iteration.csv.gz")
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    plain.unlink()
    for what in (tmp_path / "model", packed):
        assert read(what).ticks.collect().drop("file").equals(expected)
    packed.write_bytes(packed.read_bytes()[:-20])
    (damage,) = read(packed).damaged
    assert damage.file == str(packed)
    assert "cut short" in damage.what


def test_repeated_rows_are_named_and_counted_once(tmp_path):
    path = makers.write(tmp_path / "0-iteration.csv", makers.iteration(range(3)))
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *rows, *rows[:12], ""]))
    found = read(path)
    assert found.ticks.collect().height == len(rows)
    (damage,) = found.damaged
    assert (damage.line, damage.what) == (len(rows) + 2, "12 rows stand there before; counted once")
