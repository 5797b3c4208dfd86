"""Ticks that are left for who watches, by a clock that stands still."""

import os

import numpy as np
import pytest

from racecraft.formats import live_ticks
from racecraft.formats.checkpoint import save_policy
from racecraft.formats.live_ticks import (
    LiveTicks,
    forget_live_ticks,
    latest_request,
    read_live_ticks,
    request_ticks,
    write_live_ticks,
)
from racecraft.formats.run_folder import RunFolder

NOW = 1_700_000_000.0


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(live_ticks.time, "time", lambda: NOW)
    return RunFolder(tmp_path)


def test_a_wish_holds_for_three_seconds(run):
    assert latest_request(run) is None
    request_ticks(run)
    assert run.watched.exists()
    for ago, holds in ((0, True), (2_999_000_000, True), (3_000_000_000, False), (9_000_000_000, False)):
        wished = int(NOW) * 10**9 - ago
        os.utime(run.watched, ns=(wished, wished))
        assert latest_request(run) == (wished if holds else None)
    request_ticks(RunFolder(run.path / "gone"))


def test_what_is_left_is_read_and_is_live_for_five_seconds(run):
    columns = {"x_m": np.arange(6, dtype=np.float64).reshape(3, 2), "objects.0": np.ones((3, 1, 2, 3), np.float32)}
    assert read_live_ticks(run) is None
    write_live_ticks(run, 41, columns)
    told = read_live_ticks(run)
    assert (told.last, told.written, told.are_live) == (41, NOW, True)
    assert set(told.columns) == set(columns)
    for name, column in columns.items():
        np.testing.assert_array_equal(told.columns[name], column)
    assert [path.name for path in run.path.iterdir()] == [run.live.name]
    assert [LiveTicks(0, NOW - ago, {}).are_live for ago in (4.5, 5.0, 5.5)] == [True, False, False]
    forget_live_ticks(run)
    forget_live_ticks(run)
    assert read_live_ticks(run) is None
    write_live_ticks(RunFolder(run.path / "gone"), 1, columns)


def test_a_file_of_another_kind_or_half_a_file_holds_no_ticks(run):
    save_policy(run.live, {"w": np.zeros(2)}, {})
    assert read_live_ticks(run) is None
    write_live_ticks(run, 1, {"x_m": np.zeros((2, 2))})
    run.live.write_bytes(run.live.read_bytes()[:-1])
    assert read_live_ticks(run) is None
