"""The record of a search: which trial is its best, and what stands in its file."""

import json

import pytest

from racecraft.formats.tuning import COMPLETE, FAILED, PRUNED, RUNNING, TrialRecord, TuningRecord, best_of, write_tuning


def trial(number, score, state=COMPLETE):
    return TrialRecord(number, {"rate": 0.5}, state, score, 2.0)


@pytest.mark.parametrize(("scores", "highest", "lowest"), [
    ([0.0, 0.5, -0.5], 1, 2), ([2.0, 2.0, 1.0, 1.0], 0, 2), ([None, -3.0], 1, 1), ([0.0, -0.5], 0, 1),
])  # fmt: skip
def test_the_best_of_a_search_is_the_first_of_equals(scores, highest, lowest):
    trials = [trial(number, score) for number, score in enumerate(scores)]
    assert best_of(trials, True).number == best_of(trials[::-1], True).number == highest
    assert best_of(trials, False).number == best_of(trials[::-1], False).number == lowest
    record = TuningRecord(("train",), "score", False, True, trials, {})
    assert record.best.number == lowest


def test_only_what_came_to_its_end_with_a_score_counts():
    trials = [trial(0, 9.0, PRUNED), trial(1, 9.0, FAILED), trial(2, None, RUNNING), trial(3, None)]
    assert [one.is_done for one in (*trials, trial(4, 0.0))] == [False] * 4 + [True]
    assert best_of(trials, True) is None
    assert best_of([], True) is None
    some = [trials[0], trial(1, 2.0), trial(2, 1.0), trials[2], trial(4, 3.0)]
    shares = {"rate": 0.25, "epochs": 0.75}
    assert TuningRecord((), "score", True, False, some, shares).best_so_far == ([1, 2, 4], [2, 1, 3], [2, 2, 3])
    assert TuningRecord((), "score", False, False, some, shares).best_so_far[2] == [2, 1, 1]
    assert TuningRecord((), "score", True, False, some, shares).shares == [
        ("epochs", "75 %", 0.75), ("rate", "25 %", 0.25)
    ]  # fmt: skip


def test_the_file_says_what_it_is(tmp_path):
    record = TuningRecord(("gym", "train"), "score", True, False, [trial(0, 1.5)], {"rate": 1.0})
    write_tuning(tmp_path / "t.json", record)
    text = (tmp_path / "t.json").read_text()
    assert json.loads(text) == {
        "format": "racecraft tuning", "version": 1, "command": ["gym", "train"], "objective": "score",
        "maximise": True, "take_last": False, "importances": {"rate": 1.0},
        "trials": [
            {"number": 0, "values": {"rate": 0.5}, "state": "complete", "score": 1.5, "seconds": 2.0, "note": "",
             "taken_from": ""}
        ],
    }  # fmt: skip
    assert text.startswith('{\n  "format"')
    assert text.endswith("}\n")
