"""The record of a population: its rounds, its best, and its file."""

import json

import pytest

from racecraft.contract.errors import RunFolderError
from racecraft.formats.population import MemberRound, PopulationRecord, read_population, write_population


def member(turn, number, score=None):
    return MemberRound(turn, number, {"rate": 0.5}, f"{turn}-{number}", 0, score=score)


def record(*members, maximise=True):
    return PopulationRecord(("gym", "train"), "score", maximise, {"rate": "0..1"}, 2, 3, 7, members)


def test_members_stand_in_the_order_of_rounds_whoever_came_first():
    told = record()
    for turn, number in ((1, 0), (0, 1), (0, 0), (1, 1)):
        told = told.with_member(member(turn, number))
    assert [(one.round, one.member) for one in told.members] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    changed = told.with_member(member(1, 0, score=2.0))
    assert [one.score for one in changed.members] == [None, None, 2.0, None]
    assert [one.member for one in changed.of_round(1)] == [0, 1]
    assert changed.of_round(2) == []
    assert told.members[2].score is None


@pytest.mark.parametrize(("maximise", "expected"), [(True, [0.5, 0.0, -0.5, None]), (False, [-0.5, 0.0, 0.5, None])])
def test_the_best_is_first_and_who_has_no_score_is_last(maximise, expected):
    members = [member(0, number, score) for number, score in enumerate((0.0, None, 0.5, -0.5))]
    told = record(*members, maximise=maximise)
    assert [one.score for one in told.best_first(members)] == expected
    assert told.best.score == expected[0]
    assert record(member(0, 0), maximise=maximise).best is None
    assert record().best is None


def test_a_record_comes_back_and_a_folder_without_one_has_none(tmp_path):
    assert read_population(tmp_path) is None
    told = record(member(0, 0, 1.5), MemberRound(1, 0, {}, "1-0", 1, 0, None, 4, "failed", 2.5, "why"))
    write_population(tmp_path, told)
    assert read_population(tmp_path) == told
    text = (tmp_path / "population.json").read_text()
    assert text.startswith('{\n  "format": "racecraft population",\n  "version": 1,')
    assert text.endswith("}\n")
    assert json.loads(text)["members"][0] == {
        "round": 0, "member": 0, "values": {"rate": 0.5}, "run": "0-0", "begun": 0, "parent": None, "score": 1.5,
        "iteration": None, "state": "", "seconds": None, "note": "",
    }  # fmt: skip


DAMAGE = [{"format": "other"}, {"version": 2}, {"members": [{}]}]


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_file_that_is_no_record_is_refused(tmp_path, damage):
    write_population(tmp_path, record())
    path = tmp_path / "population.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **damage}))
    with pytest.raises(RunFolderError, match=r"population\.json: .*; expected population\.json of version 1"):
        read_population(tmp_path)
