"""The page about logs tells every column and every function."""

from pathlib import Path

from racecraft.formats.episodes import columns_markdown
from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.logs.columns import TICK_COLUMNS

PAGE = Path(__file__).resolve().parents[4] / "docs" / "racing" / "logs.md"
HELPERS = {
    "Plot", "PlotError", "action_names", "action_table", "cells", "circuit_of", "find_segments", "find_track",
    "in_segments", "lap_features", "on_track", "per_iteration", "reward_params", "track_or_none", "with_motion",
}  # fmt: skip


def test_every_column_has_the_row_that_the_reader_gives_it():
    assert columns_markdown(TICK_COLUMNS) in PAGE.read_text(encoding="utf-8")


def test_every_plot_and_table_is_named():
    page = PAGE.read_text(encoding="utf-8")
    assert [name for name in analysis.__all__ if name not in HELPERS and f"`{name}" not in page] == []
