"""A question to the lazy table reads the columns that it names, and every row that the whole table has."""

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tests.worlds.deepracer.logs.makers import csv_text, drfc, iteration

from racecraft.worlds.deepracer.logs import asked, read, rows_of_text

WRECKS = (
    b"", b"abc", b".", b"-", b"--1.5", b"1.5.5", b"1-5", b"nan", b"inf", b"1e400", b"0x10", b" 2.5 ", b"5.", b".5",
    b"-.5", b"3e-05", b"1" * 35, b"0.12345678901234567890", b"1 2", b"1,2", b"\xff", b"2.5\r",
)  # fmt: skip


def wrecked(text, rng, count):
    """Return a trace in which so many cells hold something else."""
    lines = text.encode().splitlines()
    for row in rng.choice(np.arange(1, len(lines)), count, replace=False):
        cells = lines[row].split(b",")
        cells[rng.integers(len(cells))] = WRECKS[rng.integers(len(WRECKS))]
        lines[row] = b",".join(cells)
    return b"\n".join(lines) + b"\n"


@pytest.fixture
def compiled(monkeypatch):
    """Read little text with the compiled reader too."""
    monkeypatch.setattr(rows_of_text, "LITTLE_BYTES", 0)


@pytest.mark.parametrize("seed", range(4))
def test_any_columns_have_the_rows_of_the_whole_table(tmp_path, compiled, seed):
    rng = np.random.default_rng(seed)
    for k in range(2):
        text = csv_text(iteration(range(5 * k, 5 * k + 5), ticks=30))
        (tmp_path / f"{k}-iteration.csv").write_bytes(wrecked(text, rng, 60))
    whole = read(tmp_path)
    table = whole.ticks.collect()
    assert whole.damaged
    for _ in range(10):
        names = list(rng.choice(table.columns, rng.integers(1, 8), replace=False))
        part = read(tmp_path)
        assert_frame_equal(part.ticks.select(names).collect(), table.select(names))
        assert part.damaged == whole.damaged


def test_a_question_reads_its_columns_and_a_second_one_all(tmp_path, monkeypatch):
    read_columns = []

    def spied(sources, phase, names):
        read_columns.append(names)
        return asked_for(sources, phase, names)

    asked_for = asked.read_ticks
    monkeypatch.setattr(asked, "read_ticks", spied)
    ticks = read(drfc(tmp_path)).ticks
    assert ticks.collect_schema().names()[:2] == ["round", "phase"]
    assert read_columns == []
    ticks.filter(pl.col("phase") == "training").select(pl.col("reward").sum()).collect()
    ticks.select("reward").collect()
    ticks.select("x_m").collect()
    ticks.collect()
    assert read_columns == [{"reward", "phase"}, None]


def test_filters_and_heads_hold_in_their_order(tmp_path):
    logs = read(drfc(tmp_path))
    table, late = logs.ticks.collect(), pl.col("tick") > 10
    for question in (
        lambda one: one.filter(late).head(3).select("x_m", "tick"),
        lambda one: one.head(12).filter(late).select("tick", "x_m"),
        lambda one: one.tail(3),
        lambda one: one.select(pl.len()),
        lambda one: one.with_columns(twice=2 * pl.col("reward")).select("twice"),
    ):
        assert_frame_equal(question(read(tmp_path).ticks).collect(), question(table))


@pytest.mark.timeout(60)
def test_one_question_may_ask_the_table_twice(tmp_path, compiled):
    drfc(tmp_path)
    ticks = read(tmp_path).ticks
    mean = ticks.group_by("unique_episode").agg(pl.col("reward").mean().alias("mean"))
    joined = ticks.join(mean, on="unique_episode", maintain_order="left").select("unique_episode", "x_m", "mean")
    assert joined.collect().height == ticks.select(pl.len()).collect().item()


def test_an_empty_table_has_the_columns_that_were_asked_for(tmp_path):
    (tmp_path / "0-iteration.csv").write_bytes(b"")
    assert read(tmp_path).ticks.select("reward", "phase").collect().columns == ["reward", "phase"]
