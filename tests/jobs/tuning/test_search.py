"""The search itself, with trials made by hand: nothing is trained."""

import json

import pytest

from racecraft.contract.errors import SettingError
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.tuning import COMPLETE, FAILED, PRUNED
from racecraft.jobs.tuning import search as searching
from racecraft.jobs.tuning.search import TrialStatus, search
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, read_parameter
from racecraft.jobs.tuning.study import Study, TuningError
from racecraft.jobs.tuning.training_trials import Objective, check_command, column_of

PARAMETERS = {"x": ContinuousParameter(-4.0, 4.0), "kind": CategoricalParameter(["plain", "shifted"])}


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch):
    monkeypatch.setattr(searching, "LOOK_SECONDS", 0.0)


class Scripted:
    """A trial that tells one more score at every look."""

    def __init__(self, scores, failure=""):
        self.scores, self.failure, self.seen, self.stopped = scores, failure, 0, False

    def poll(self):
        self.seen = min(self.seen + 1, len(self.scores))
        told = tuple(enumerate(self.scores[: self.seen], 1))
        return TrialStatus(told, self.stopped or self.seen == len(self.scores), self.failure)

    def stop(self):
        self.stopped = True


def hill(number, values):
    """Best at x = 1 where it is plain, at 2, and higher, where it is shifted."""
    top = 2.0 if values["kind"] == "shifted" else 1.0
    return Scripted([top - (values["x"] - top) ** 2])


def test_what_does_well_is_tried_near_by_and_the_best_is_told(tmp_path):
    study, told = Study(tmp_path, PARAMETERS), []
    search(study, hill, 30, 2, told.append)
    best = study.best()
    assert sorted(one.number for one in told) == list(range(30))
    assert (best.values["kind"], best.values["x"]) == ("shifted", pytest.approx(2.0, abs=0.5))
    later = [abs(one.values["x"] - 2.0) for one in study.trials()[15:]]
    assert sorted(later)[len(later) // 2] < 1.5, "of anything, evenly, half would be 2 away"
    shares = study.importances()
    assert set(shares) == {"x", "kind"}
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["x"] > shares["kind"]


def test_a_search_that_is_gone_on_with_keeps_its_trials(tmp_path):
    search(Study(tmp_path, PARAMETERS), hill, 3, 1, lambda one: None)
    again = Study(tmp_path, PARAMETERS)
    before = [one.values for one in again.trials()]
    search(again, hill, 5, 1, lambda one: None)
    assert [one.values for one in again.trials()][:3] == before
    assert len(again.trials()) == 5
    with pytest.raises(TuningError, match="with other bounds or another aim"):
        Study(tmp_path, {"x": ContinuousParameter(0.0, 1.0)})
    with pytest.raises(TuningError, match="with other bounds or another aim"):
        Study(tmp_path, PARAMETERS, maximise=False)


def test_a_hopeless_trial_is_stopped(tmp_path):
    trials = [Scripted([10.0, 20.0, 30.0, 40.0]) for _ in range(4)] + [Scripted([1.0, 2.0, 3.0, 4.0])]
    study = Study(tmp_path, PARAMETERS)
    search(study, lambda number, values: trials[number], 5, 1, lambda one: None)
    assert [one.state for one in study.trials()] == [COMPLETE] * 4 + [PRUNED]
    assert (trials[4].stopped, trials[3].stopped) == (True, False)
    assert study.trials()[4].score < 4.0, "it did not come to its end"
    (tmp_path / "free").mkdir()
    free = Study(tmp_path / "free", PARAMETERS, pruner="none")
    search(free, lambda number, values: Scripted(trials[number].scores), 5, 1, lambda one: None)
    assert {one.state for one in free.trials()} == {COMPLETE}


def test_what_fails_is_told_and_what_only_fails_ends_the_search(tmp_path):
    study = Study(tmp_path, PARAMETERS)
    trials = [Scripted([1.0]), Scripted([1.0], failure="exit code 2: no such thing"), Scripted([])]
    search(study, lambda number, values: trials[number], 3, 1, lambda one: None)
    notes = [(one.state, one.note) for one in study.trials()]
    assert notes == [(COMPLETE, ""), (FAILED, "exit code 2: no such thing"), (FAILED, "it ended without a score")]
    (tmp_path / "b").mkdir()
    with pytest.raises(TuningError, match="The first 2 trials failed. Number 1: no such thing"):
        search(Study(tmp_path / "b", PARAMETERS), lambda *_: Scripted([1.0], "no such thing"), 9, 1, lambda one: None)


def test_ctrl_c_stops_what_is_under_way_and_the_search_can_go_on(tmp_path):
    begun = []

    def launch(number, values):
        if number == 2:
            raise KeyboardInterrupt
        begun.append(Scripted([1.0] * 1000))
        return begun[-1]

    study = Study(tmp_path, PARAMETERS)
    with pytest.raises(KeyboardInterrupt):
        search(study, launch, 9, 3, lambda one: None)
    assert [one.stopped for one in begun] == [True, True]
    again = Study(tmp_path, PARAMETERS)
    search(again, hill, 6, 1, lambda one: None)
    assert [one.state for one in again.trials()] == [FAILED] * 3 + [COMPLETE] * 3


def test_a_trial_that_goes_on_after_its_search_was_killed_counts(tmp_path):
    killed = Study(tmp_path, PARAMETERS)
    for _ in range(2):
        killed.ask()
    killed.report(0, 1.0, 1)
    went_on = Scripted([1.0, 3.0])
    study = Study(tmp_path, PARAMETERS)
    search(study, hill, 3, 1, lambda one: None, find={0: went_on}.get)
    assert [(one.state, one.note) for one in study.trials()[:2]] == [(COMPLETE, ""), (FAILED, searching.BROKEN_OFF)]
    assert study.trials()[0].score == 3.0
    assert len(study.trials()) == 3


def test_an_earlier_search_is_taken_over_where_it_fits(tmp_path):
    for name in ("first", "second", "narrow"):
        (tmp_path / name).mkdir()
    search(Study(tmp_path / "first", PARAMETERS), hill, 6, 1, lambda one: None)
    then = Study(tmp_path / "second", PARAMETERS)
    assert then.take_over(tmp_path / "first") == 6
    assert then.best().score == Study(tmp_path / "first", PARAMETERS).best().score
    narrow = Study(tmp_path / "narrow", {**PARAMETERS, "x": ContinuousParameter(0.0, 4.0)})
    inside = sum(one.values["x"] >= 0 for one in Study(tmp_path / "first", PARAMETERS).trials())
    assert narrow.take_over(tmp_path / "first") == inside
    with pytest.raises(TuningError, match="holds no study.sqlite"):
        then.take_over(tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ppo.epochs", "expected NAME=LOW..HIGH"),
        ("a=2..1", "the lesser first"),
        ("a=0..1:log", "a lower end above 0"),
        ("a=nan..1", "is no range"),
    ],
)
def test_what_no_parameter_can_be_is_refused(text, words):
    with pytest.raises(SettingError, match=words):
        read_parameter(text)


def test_wrong_words_of_a_search_are_named(tmp_path):
    with pytest.raises(SettingError, match=r"no sampler 'tpi'; expected one of tpe, random, grid. .*tpe"):
        Study(tmp_path, PARAMETERS, sampler="tpi")
    with pytest.raises(SettingError, match="x is a range, and a grid has values"):
        Study(tmp_path, PARAMETERS, sampler="grid")
    for words, said in (
        (["gym", "list"], "trains nothing"),
        (["train", "--stop", "laps", "--run", "r"], "--run: every trial has a run of its own"),
        (["gym", "train", "CartPole-v1"], "has no --stop"),
    ):
        with pytest.raises(SettingError, match=said):
            check_command(words)
    assert check_command(["gym", "train", "A", "--stop", "steps=9"]) == ("gym", "train", "A", "--stop=steps=9")
    with pytest.raises(SettingError, match="has no group"):
        Objective("reward=[0-9](?:x)")


def test_a_grid_is_tried_whole(tmp_path):
    study = Study(
        tmp_path, {"a": CategoricalParameter(["1", "2"]), "b": CategoricalParameter(["x", "y"])}, sampler="grid"
    )
    search(study, lambda number, values: Scripted([float(values["a"])]), 4, 1, lambda one: None)
    assert {tuple(one.values.values()) for one in study.trials()} == {("1", "x"), ("1", "y"), ("2", "x"), ("2", "y")}


def test_the_objective_is_read_from_the_runs_own_lines(tmp_path):
    path = tmp_path / "metrics.jsonl"
    assert column_of(RunFolder(tmp_path), "evaluation_score") == []
    rows = [{"iteration": k, "evaluation_score": score} for k, score in enumerate([3.0, None, 1.0, 5.0], 1)]
    path.write_text("\n".join(map(json.dumps, rows)) + '\n{"iteration": 5, "eval')
    figures = column_of(RunFolder(tmp_path), "evaluation_score")
    assert figures == [(1, 3.0), (3, 1.0), (4, 5.0)]
    assert Objective().so_far(figures) == ((1, 3.0), (3, 3.0), (4, 5.0))
    assert Objective(maximise=False).so_far(figures) == ((1, 3.0), (3, 1.0), (4, 1.0))
    assert Objective(take_last=True).so_far(figures) == ((1, 3.0), (3, 1.0), (4, 5.0))
    with pytest.raises(SettingError, match="--objective evaluation_scor: expected one of iteration, evaluation_score"):
        column_of(RunFolder(tmp_path), "evaluation_scor")
