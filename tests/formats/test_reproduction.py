"""The table of a comparison: its own measure by hand, and that it comes back as it was written."""

import dataclasses
import json

import pytest

from racecraft.contract.errors import RunFolderError
from racecraft.formats.reproduction import Moment, RowResult, best_over_old, read_table, write_table


def row(name, reward, length, algorithm="dqn"):
    return RowResult(name, name.upper(), algorithm, 2, 1.5, 100, 50.0, 9, reward, 0.25, length, 0.5, f"runs/{name}")


ROWS = [
    row("old", 2.0, 8.0), row("a", 5.0, 16.0), row("b", 6.0, 4.0), row("ours", 9.0, 20.0),
    row("random", 0.25, 2.0, ""), row("masked-random", 0.5, 3.0, ""),
]  # fmt: skip


def told(rows):
    return [(one.among, one.row, one.reward, one.length) for one in best_over_old(rows)]


def test_the_best_of_each_kind_stands_beside_the_old_trainer():
    assert told(ROWS) == [
        ("the source's rows", "b", 3.0, 0.5), ("all rows, ours among them", "ours", 4.5, 2.5),
        ("chance", "masked-random", 0.25, 0.375),
    ]  # fmt: skip
    assert told(ROWS[1:]) == [], "without the old one there is nothing to stand beside"
    assert told(ROWS[:1]) == []
    assert [one[0] for one in told([ROWS[0], ROWS[3]])] == ["all rows, ours among them"]


@pytest.mark.parametrize(("old", "new"), [(2.0, 0.0), (0.0, 2.0), (-1.0, -2.0), (-1.0, 2.0)])
def test_a_reward_that_is_not_above_nothing_is_no_multiple(old, new):
    assert told([row("old", old, 8.0), row("a", new, 4.0)]) == [("the source's rows", "a", None, 0.5)]


def test_a_table_comes_back_and_its_rows_are_a_csv_file_too(tmp_path):
    curve = [Moment(1.0, 2.0, 0.5, 8.0, 0.25), Moment(2.0, 3.0, 0.5, 9.0, 0.25)]
    rows = [(ROWS[0], curve), (dataclasses.replace(ROWS[1], minutes=None, processor_share=0.5), [])]
    places = write_table(tmp_path, {"minutes": 3}, {"cores": 2}, rows)
    assert places == (tmp_path / "table.json", tmp_path / "table.csv")
    assert read_table(places[0]) == ({"minutes": 3}, rows)
    whole = json.loads(places[0].read_text())
    assert (whole["format"], whole["version"], whole["machine"]) == ("racecraft reproduction", 1, {"cores": 2})
    assert whole["best_over_old"] == [{"among": "the source's rows", "row": "a", "reward": 2.5, "length": 2.0}]
    assert places[0].read_text().startswith('{\n  "format"')
    assert places[1].read_text() == (
        "row,title,algorithm,cores,minutes,steps,steps_per_second,games,reward,reward_error,length,length_error,run,"
        "processor_share\n"
        "old,OLD,dqn,2,1.5,100,50.0,9,2.0,0.25,8.0,0.5,runs/old,\n"
        "a,A,dqn,2,,100,50.0,9,5.0,0.25,16.0,0.5,runs/a,0.5\n"
    )


DAMAGE = [{"format": "other"}, {"version": 2}, {"version": 0}, {"rows": None}, {"rows": [{}]}]


@pytest.mark.parametrize("damage", DAMAGE)
def test_what_is_no_such_table_is_refused(tmp_path, damage):
    place = write_table(tmp_path, {}, {}, [])[0]
    assert read_table(place) == ({}, [])
    place.write_text(json.dumps({**json.loads(place.read_text()), **damage}))
    with pytest.raises(RunFolderError, match=r"table\.json: .*; expected a table\.json of version 1"):
        read_table(place)
