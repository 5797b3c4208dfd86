"""Population-based training: by hand over members that take no time, and through the command over real trainings."""

import dataclasses
import json

import numpy as np
import pytest
from tests.jobs.conftest import home  # noqa: F401 - a fixture
from typer.testing import CliRunner

import racecraft as rc
from racecraft.analysis.population_page import ancestors
from racecraft.cli.app import app
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.population import FILE, PopulationRecord, read_population
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs.tuning import population
from racecraft.jobs.tuning.population import explore, first_values, train
from racecraft.jobs.tuning.population_trials import check_round
from racecraft.jobs.tuning.search import TrialStatus
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter
from racecraft.jobs.tuning.study import TuningError
from racecraft.players.trained import load_policy

RANGES = {
    "ppo.learning_rate": ContinuousParameter(1e-5, 1e-2, "Logarithmic"),
    "ppo.epochs": IntegerParameter(2, 20),
    "ppo.kind": CategoricalParameter(("a", "b", "c")),
}
ASKED = PopulationRecord(("gym", "train", "X", "--stop=steps=1"), "score", True, {"lr": "0..1"}, 8, 4, 3)
LR = {"lr": ContinuousParameter(0.0, 1.0)}


class Members:
    """A launcher whose members gain, every round, as much as their learning rate; weights are what they have gained."""

    def __init__(self, failing=()):
        self.weights, self.begun, self.failing = {}, [], failing
        self.break_at = None

    def __call__(self, one, parent):
        if self.break_at == (one.round, one.member):
            raise KeyboardInterrupt
        self.begun.append((one.round, one.member))
        start = self.weights.get((one.round - 1, one.member if parent is None else parent.member), 0.0)
        self.weights[one.round, one.member] = start + one.values["lr"]
        return Member(self.weights[one.round, one.member], (one.round, one.member) in self.failing)


class Member:
    def __init__(self, score, fails):
        self.score, self.fails = score, fails

    def poll(self):
        return TrialStatus(() if self.fails else ((1, self.score),), True, "it broke" if self.fails else "")

    def stop(self):
        raise AssertionError("it has ended")

    def last_iteration(self):
        return 7


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch):
    monkeypatch.setattr(population, "LOOK_SECONDS", 0.0)


def test_the_worst_quarter_takes_over_the_weights_of_the_best_and_moves_on_from_its_settings(tmp_path):
    """Eight members: two of them take over in each round, from one of the two best of the round before."""
    members = Members()
    record = train(tmp_path, ASKED, LR, members, 3, lambda one: None)
    assert len(record.members) == 8 * 4
    for number in range(1, 4):
        before = {one.member: one for one in record.of_round(number - 1)}
        ranked = [one.member for one in record.best_first(list(before.values()))]
        took = {one.member: one for one in record.of_round(number) if one.parent is not None}
        assert set(took) == set(ranked[-2:])
        for one in took.values():
            assert one.parent in ranked[:2]
            assert one.run == f"{one.member}-{number}"
            assert one.begun == number
            assert one.score == pytest.approx(before[one.parent].score + one.values["lr"])
        for one in record.of_round(number):
            if one.parent is None:
                kept = before[one.member]
                assert (one.values, one.run, one.begun) == (kept.values, kept.run, kept.begun)
                assert one.score == pytest.approx(kept.score + one.values["lr"])
    assert read_population(tmp_path) == record


def test_who_takes_over_is_begun_first_and_the_line_of_the_best_is_told(tmp_path):
    members = Members()
    record = train(tmp_path, ASKED, LR, members, 1, lambda one: None)
    for number in range(1, 4):
        order = [member for rounds, member in members.begun if rounds == number]
        took = {one.member for one in record.of_round(number) if one.parent is not None}
        assert set(order[: len(took)]) == took
    line = ancestors(record, record.best)
    assert [one.round for one in line] == list(range(record.best.round + 1))
    assert sum(one.values["lr"] for one in line) == pytest.approx(record.best.score)


def test_broken_off_it_goes_on_and_comes_to_the_same(tmp_path):
    (tmp_path / "whole").mkdir()
    (tmp_path / "broken").mkdir()
    whole = train(tmp_path / "whole", ASKED, LR, Members(), 1, lambda one: None)
    members = Members()
    members.break_at = (2, 3)
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path / "broken", ASKED, LR, members, 1, lambda one: None)
    begun, members.break_at = len(members.begun), None
    assert begun < 8 * 3
    broken = train(tmp_path / "broken", ASKED, LR, members, 1, lambda one: None)
    assert len(members.begun) == 8 * 4, "nothing was trained twice"
    strip = [dataclasses.replace(one, seconds=None) for one in broken.members]
    assert strip == [dataclasses.replace(one, seconds=None) for one in whole.members]


def test_a_member_that_failed_takes_over_and_a_round_that_failed_whole_is_told(tmp_path):
    record = train(tmp_path, ASKED, LR, Members(failing={(0, 5)}), 8, lambda one: None)
    assert record.of_round(0)[5].note == "it broke"
    assert record.of_round(1)[5].parent is not None
    (tmp_path / "all").mkdir()
    with pytest.raises(TuningError, match="every member of round 0 failed. Last: it broke"):
        train(tmp_path / "all", ASKED, LR, Members(failing={(0, k) for k in range(8)}), 8, lambda one: None)


def test_another_population_is_refused_and_more_rounds_are_not(tmp_path):
    train(tmp_path, ASKED, LR, Members(), 8, lambda one: None)
    with pytest.raises(TuningError, match="another population lies here"):
        train(tmp_path, dataclasses.replace(ASKED, seed=4), LR, Members(), 8, lambda one: None)
    more = train(tmp_path, dataclasses.replace(ASKED, rounds=6), LR, Members(), 8, lambda one: None)
    assert len(more.members) == 8 * 6
    (tmp_path / FILE).write_text('{"format": "racecraft population", "version": 2}')
    with pytest.raises(RunFolderError, match="version 1"):
        read_population(tmp_path)


def test_settings_move_within_their_bounds_and_whole_numbers_by_one_at_least():
    rng = np.random.default_rng(0)
    values, seen = first_values(RANGES, rng), []
    for _ in range(400):
        moved = explore(values, RANGES, rng)
        assert 1e-5 <= moved["ppo.learning_rate"] <= 1e-2
        assert 2 <= moved["ppo.epochs"] <= 20
        assert isinstance(moved["ppo.epochs"], int)
        seen.append(moved["ppo.learning_rate"] / values["ppo.learning_rate"])
        values = moved
    near = sum(abs(ratio - 0.8) < 1e-9 or abs(ratio - 1.2) < 1e-9 for ratio in seen)
    assert 0.6 < near / len(seen) < 0.85, "three quarters move by a fifth, but for those at a bound"
    assert all(explore({"n": 2}, {"n": IntegerParameter(2, 9)}, rng)["n"] in range(2, 10) for _ in range(50))
    moved = {explore({"n": 3}, {"n": IntegerParameter(1, 9)}, np.random.default_rng(k))["n"] for k in range(60)}
    assert {2, 4} <= moved


def test_a_round_has_an_end_and_weights_keep_their_shape():
    check_round(("gym", "train", "X", "--stop=score=5", "--stop=steps=100"), LR)
    with pytest.raises(SettingError, match="a round needs a --stop of minutes, iterations, steps; found score=5"):
        check_round(("gym", "train", "X", "--stop=score=5"), LR)
    with pytest.raises(SettingError, match="network.hidden_units"):
        check_round(("gym", "train", "X", "--stop=steps=5"), {"network.hidden_units": IntegerParameter(8, 9)})


def test_a_command_is_trained_as_a_population(home, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    asked = ["tune", "--sampler", "pbt", "--population", "2", "--rounds", "2", "--parallel", "2"]
    words = ["gym", "train", "CartPole-v1", "--no-pictures", "--stop", "iterations=2", "--set", "evaluation.every=1"]
    words += ["--set", "evaluation.episodes=2", "--set", "rollout.horizon=16"]
    done = CliRunner().invoke(app, [*asked, "--param", "ppo.learning_rate=1e-4..1e-2:log", "--json", *words])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout.splitlines()[-1])
    record = read_population(tmp_path / told["tuning"])
    assert [one.state for one in record.members] == ["complete"] * 4
    took, kept = sorted(record.of_round(1), key=lambda one: one.parent is None)
    parent = next(one for one in record.of_round(0) if one.member == took.parent)
    folder = tmp_path / told["tuning"] / "trials"
    # who went on has trained twice as long in one run; who took over began with the other's weights
    assert kept.iteration == 4
    assert RunFolder.open(folder / kept.run).read_job()["asked"]["stops"] == ["iterations=2"]
    assert took.iteration == 2
    begun, theirs = load_policy(f"{folder / took.run}:0"), load_policy(f"{folder / parent.run}:{parent.iteration}")
    mine, others = begun.policy.network.state_dict(), theirs.policy.network.state_dict()
    assert all((mine[name] == others[name]).all() for name in mine)
    settings = RunFolder.open(folder / took.run).read_job()["settings"]["ppo"]
    assert settings["learning_rate"] == took.values["ppo.learning_rate"]
    assert told["best"]["score"] == max(one.score for one in record.members)
    assert "weights were taken over" in (tmp_path / told["page"]).read_text()


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        (["--sampler", "pbt", "--trials", "9"], "--trials: --sampler pbt has a population"),
        (["--population", "3"], "--population: only --sampler pbt"),
        (["--sampler", "pbt", "--population", "1"], "1 members, 5 rounds"),
    ],
)
def test_options_of_the_other_kind_are_refused(home, tmp_path, monkeypatch, words, letter):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    asked = ["tune", *words, "--param", "ppo.epochs=1..3", "gym", "train", "CartPole-v1", "--stop", "iterations=2"]
    done = CliRunner().invoke(app, asked)
    assert letter in str(done.exception)
    assert not (tmp_path / "tunings").exists()


@pytest.mark.long
def test_from_python_populations_and_searches_are_begun_and_gone_on_with(home, tmp_path):  # noqa: F811
    words = "gym train CartPole-v1 --no-pictures --stop iterations=1 --set evaluation.every=1"
    words += " --set evaluation.episodes=1 --set rollout.horizon=16"
    ranges = {"ppo.learning_rate": "1e-4..1e-2:log"}
    asked = {"population": 2, "rounds": 2, "parallel": 2, "quiet": True}
    record = rc.train_population(words, ranges, tmp_path / "population", **asked)
    assert [one.state for one in record.members] == ["complete"] * 4
    assert rc.train_population(words, ranges, tmp_path / "population", **asked) == record
    found = rc.tune(words, ranges, tmp_path / "search", sampler="random", trials=1, quiet=True)
    assert [one.state for one in found.trials] == ["complete"]
    with pytest.raises(SettingError, match="no parameter is varied"):
        rc.tune(words, {}, tmp_path / "none")
    with pytest.raises(SettingError, match="trains nothing"):
        rc.train_population("gym list", ranges, tmp_path / "none")
    assert not (tmp_path / "none").exists()
