"""Episode tables: written by name, read by name, refused when damaged."""

import numpy as np
import polars as pl
import pytest

from racecraft.contract.errors import ContractError
from racecraft.formats.episodes import (
    EPISODE_COLUMNS,
    EpisodeFileError,
    columns_of_all,
    read_episodes,
    write_episodes,
)


def table(ticks=4):
    record = np.array([(0.5 * tick, tick) for tick in range(ticks)], [("gain", "f4"), ("latency", "f4")])
    kinds = {"bool": np.ones(ticks, bool), "str": np.array(["in_progress"] * ticks), "struct": record}
    return {
        column.name: kinds.get(column.dtype, np.arange(ticks).astype("float64" if column.dtype[0] == "f" else "int64"))
        for column in EPISODE_COLUMNS
    }


def test_every_column_comes_back_with_its_type(tmp_path):
    write_episodes(tmp_path / "e.parquet", table())
    frame = read_episodes(tmp_path / "e.parquet")
    assert frame.columns == [column.name for column in EPISODE_COLUMNS]
    for column in EPISODE_COLUMNS:
        if column.dtype == "struct":
            told = [tuple(row.values()) for row in frame[column.name].to_list()]
            assert (told, set(frame[column.name].struct.schema.values())) == (
                table()[column.name].tolist(),
                {pl.Float32()},
            )
            continue
        if column.dtype != "str":
            assert frame[column.name].to_numpy().dtype == column.dtype, column.name
        assert frame[column.name].to_list() == table()[column.name].tolist(), column.name


def test_few_columns_and_columns_of_ones_own_are_welcome(tmp_path):
    few = {name: table()[name] for name in ("time_s", "tick", "episode")}
    write_episodes(tmp_path / "e.parquet", {**few, "lap_mood": np.arange(4)})
    assert read_episodes(tmp_path / "e.parquet").columns == ["episode", "tick", "time_s", "lap_mood"]
    assert read_episodes(tmp_path / "e.parquet", ["tick"]).shape == (4, 1)


@pytest.mark.parametrize("change", [{"tick": None}, {"x_m": np.zeros(3)}, {"x_m": np.zeros((4, 2))}])
def test_a_table_that_is_none_is_the_programmers_error(tmp_path, change):
    columns = {name: values for name, values in {**table(), **change}.items() if values is not None}
    with pytest.raises(ContractError, match="Episodes need"):
        write_episodes(tmp_path / "e.parquet", columns)
    assert list(tmp_path.iterdir()) == []


def test_files_that_cannot_be_read_get_letters(tmp_path):
    path = tmp_path / "e.parquet"
    with pytest.raises(EpisodeFileError, match="no such file"):
        read_episodes(path)
    write_episodes(path, table())
    with pytest.raises(EpisodeFileError, match=r"e\.parquet: hight: there is no such column; expected one of episode"):
        read_episodes(path, ["hight"])
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(EpisodeFileError, match="damaged or half written"):
        read_episodes(path)
    pl.DataFrame({"a": [1]}).write_parquet(path)
    with pytest.raises(EpisodeFileError, match="another kind"):
        read_episodes(path)
    pl.DataFrame({"a": [1]}).write_parquet(path, metadata={"format": "racecraft episodes", "version": "9"})
    with pytest.raises(EpisodeFileError, match="version 9; expected version 1"):
        read_episodes(path)


def record(*rows):
    return np.array(list(rows), [(f"n_{number}", "f4") for number in range(len(rows[0]))])


def test_tables_are_laid_below_each_other_and_what_a_record_lacks_is_nothing():
    """A course with fewer objects has nan for the others, an episode with fewer differences 0."""
    whole = columns_of_all([
        {"episode": np.array([0, 0]), "objects": record((1,), (2,)), "variation": record((7, 8), (9, 10))},
        {"episode": np.array([1]), "x_m": np.array([2.5])},
        {"episode": np.array([2]), "objects": record((3, 4)), "variation": record((11,))},
    ])  # fmt: skip
    assert list(whole) == ["episode", "objects", "variation", "x_m"]
    assert whole["episode"].tolist() == [0, 0, 1, 2]
    assert whole["x_m"].tolist() == [2.5]
    assert whole["variation"].tolist() == [(7, 8), (9, 10), (0, 0), (11, 0)]
    np.testing.assert_array_equal(whole["objects"]["n_0"], [1, 2, np.nan, 3])
    np.testing.assert_array_equal(whole["objects"]["n_1"], [np.nan, np.nan, np.nan, 4])
