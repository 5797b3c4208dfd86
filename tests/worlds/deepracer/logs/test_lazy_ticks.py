"""The lazy table of ticks: read once, at its first query."""

import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tests.worlds.deepracer.logs.makers import drfc

from racecraft.worlds.deepracer.logs import lazy_ticks, read
from racecraft.worlds.deepracer.logs.ticks import read_ticks


def test_files_are_read_once_at_the_first_query(tmp_path, monkeypatch):
    reads = []

    def counted(sources, phase):
        reads.append(phase)
        return read_ticks(sources, phase)

    monkeypatch.setattr(lazy_ticks, "read_ticks", counted)
    ticks = read(drfc(tmp_path)).ticks
    assert ticks.collect_schema().names()[:2] == ["round", "phase"]
    assert reads == []
    ticks.filter(pl.col("phase") == "training").select(pl.col("reward").sum()).collect()
    ticks.collect()
    assert reads == [None]


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
def test_one_query_may_use_the_table_twice(tmp_path):
    drfc(tmp_path)
    ticks = read(tmp_path).ticks
    mean = ticks.group_by("unique_episode").agg(pl.col("reward").mean().alias("mean"))
    joined = ticks.join(mean, on="unique_episode", maintain_order="left").select("unique_episode", "x_m", "mean")
    assert joined.collect().height == ticks.select(pl.len()).collect().item()


def test_an_empty_table_has_the_columns_that_were_asked_for(tmp_path):
    (tmp_path / "0-iteration.csv").write_bytes(b"")
    assert read(tmp_path).ticks.select("reward", "phase").collect().columns == ["reward", "phase"]
