"""Searches over real jobs: a training command of ours, and an estimator's script that takes no time."""

import json
import sqlite3

import pytest
from tests.jobs.conftest import end_supervisor, home  # noqa: F401 - a fixture
from typer.testing import CliRunner

from racecraft.cli.app import app
from racecraft.contract.errors import SettingError
from racecraft.estimator import (
    CategoricalParameter,
    ContinuousParameter,
    HyperparameterTuner,
    HyperparameterTuningJobAnalytics,
    IntegerParameter,
    RLEstimator,
    RLToolkit,
    WarmStartConfig,
    WarmStartTypes,
)
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.tuning import dry_run
from racecraft.jobs.tuning.dry_run import require_understood
from racecraft.jobs.tuning.space import read_parameter
from racecraft.jobs.tuning.study import TuningError

SCRIPT = """
import argparse
asked = argparse.ArgumentParser()
asked.add_argument("--lr", type=float)
asked.add_argument("--layers", type=int)
asked = asked.parse_args()
for step in range(3):
    print("episode_reward_mean:", step + asked.layers - abs(asked.lr - 0.5))
"""
TINY = ("--no-pictures", "--stop", "iterations=2", "--set", "evaluation.every=1", "--set", "evaluation.episodes=1") + (
    "--set", "rollout.horizon=16",
)  # fmt: skip


def test_a_command_is_tuned_and_its_best_is_told(home, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    asked = ["tune", "--trials", "2", "--param", "ppo.learning_rate=1e-4..1e-2:log", "--param", "ppo.epochs=1..2"]
    done = CliRunner().invoke(app, [*asked, "--json", "gym", "train", "CartPole-v1", *TINY])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout.splitlines()[-1])
    folder = tmp_path / told["tuning"]
    facts = json.loads((folder / "tuning.json").read_text())
    assert [one["state"] for one in facts["trials"]] == ["complete", "complete"]
    scores = []
    for one in facts["trials"]:
        run = RunFolder.open(folder / "trials" / str(one["number"]))
        settings = run.read_job()["settings"]["ppo"]
        assert (settings["learning_rate"], settings["epochs"]) == tuple(one["values"].values())
        rows = [json.loads(line) for line in run.metrics.read_text().splitlines()]
        scores.append(max(row["evaluation_score"] for row in rows))
    assert [one["score"] for one in facts["trials"]] == scores
    assert told["best"]["score"] == max(scores)
    page = (folder / "tuning.html").read_text()
    assert f"--set=ppo.epochs={told['best']['values']['ppo.epochs']}" in page


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        (("--sampler", "tpi"), "no sampler 'tpi'; expected one of tpe, random, grid, pbt. Did you mean 'tpe'"),
        (("--from", "nowhere"), "nowhere: holds no study.sqlite"),
    ],
)
def test_who_is_not_here_is_named_before_a_folder_is_made(home, tmp_path, monkeypatch, words, letter):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    asked = ["tune", *words, "--param", "ppo.epochs=1..2", "gym", "train", "CartPole-v1", *TINY]
    done = CliRunner().invoke(app, asked)
    assert letter in str(done.exception)
    assert not (tmp_path / "tunings").exists()


@pytest.fixture
def understood(monkeypatch):
    """Commands of searches are not tried out in a process of their own, which has tests of its own below."""
    monkeypatch.setattr(dry_run, "_refusal", lambda words, values: "")


@pytest.mark.usefixtures("understood")
def test_a_database_that_is_damaged_or_full_is_a_letter(home, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "study.sqlite").write_bytes(b"this is no database, and it is longer than a header" * 9)
    asked = ["--param", "ppo.epochs=1..2", "gym", "train", "CartPole-v1", *TINY]
    for where, hint in (("--run", "Give another --run"), ("--from", "or put a sound file there")):
        done = CliRunner().invoke(app, ["tune", where, "there", *asked])
        assert isinstance(done.exception, TuningError)
        assert "there/study.sqlite: file is not a database" in str(done.exception)
        assert hint in str(done.exception)

    def full(*_, **__):
        try:
            raise sqlite3.OperationalError("database or disk is full")
        except sqlite3.OperationalError as error:
            raise RuntimeError("wrapped by others") from error

    monkeypatch.setattr("racecraft.jobs.tuning.study.Study.ask", full)
    done = CliRunner().invoke(app, ["tune", "--run", "full", *asked])
    assert "full/study.sqlite: database or disk is full" in str(done.exception)
    assert "Free some space and run the same command again" in str(done.exception)


def test_what_no_trial_understands_is_refused_before_the_first(home, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    param = "ppo.learning_rat=1e-4..1e-2"
    done = CliRunner().invoke(app, ["tune", "--param", param, "gym", "train", "CartPole-v1", *TINY])
    assert isinstance(done.exception, SettingError)
    assert "no trial could be begun" in str(done.exception)
    assert "Did you mean 'learning_rate'?" in str(done.exception)
    assert not (tmp_path / "tunings").exists()
    assert home.store().jobs() == []


def test_where_one_corner_can_be_trained_there_is_something_to_find(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("gym", "train", "CartPole-v1", *TINY)
    require_understood(words, dict([read_parameter("ppo.epochs=-8..8")]))
    assert list(tmp_path.iterdir()) == [], "nothing is written by reading"


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder with the script, and one home of jobs for all who tune it."""
    folder = tmp_path_factory.mktemp("workplace")
    (folder / "train.py").write_text(SCRIPT)
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("RACECRAFT_JOB_STORE", raising=False)
        patch.setenv("RACECRAFT_JOBS", str(folder / "jobs"))
        yield folder
        end_supervisor(JobPaths.of_user())


def estimator_of(script):
    return RLEstimator(script, RLToolkit.RAY, "1.6.0", "pytorch", role="r", hyperparameters={"lr": 9.0}, cores=1)


@pytest.fixture
def estimator(workplace, monkeypatch):
    monkeypatch.chdir(workplace)
    return estimator_of("train.py")


def test_an_estimator_is_tuned_as_sagemakers_is(estimator, capsys):
    tuner = HyperparameterTuner(
        estimator, "episode_reward_mean", {"lr": ContinuousParameter(0.0, 1.0), "layers": IntegerParameter(1, 3)},
        max_jobs=3, max_parallel_jobs=2,
    )  # fmt: skip
    tuner.fit()
    rows = tuner.analytics().rows()
    assert [row["TrainingJobStatus"] for row in rows] == ["Completed"] * 3
    for row in rows:
        assert row["FinalObjectiveValue"] == pytest.approx(2 + row["layers"] - abs(row["lr"] - 0.5))
    best = max(rows, key=lambda row: row["FinalObjectiveValue"])
    assert tuner.best_training_job() == best["TrainingJobName"]
    told = tuner.describe()["BestTrainingJob"]
    assert told["TunedHyperParameters"] == {"lr": str(best["lr"]), "layers": str(best["layers"])}
    assert tuner.best_estimator().hyperparameters()["layers"] == best["layers"]
    assert best["TrainingJobName"] in capsys.readouterr().out


def test_words_that_no_tuner_takes_are_named(estimator):
    ranges = {"lr": ContinuousParameter(0.0, 1.0)}
    with pytest.raises(SettingError, match=r"objective_metric_name is 'reward'; expected one of .*episode_reward_mean"):
        HyperparameterTuner(estimator, "reward", ranges)
    with pytest.raises(SettingError, match="strategy is 'Bayes'.*Bayesian"):
        HyperparameterTuner(estimator, "episode_reward_mean", ranges, strategy="Bayes")
    with pytest.warns(UserWarning, match="tags has no meaning"):
        tuner = HyperparameterTuner(estimator, "episode_reward_mean", ranges, tags=[])
    with pytest.raises(SettingError, match="expected fit"):
        tuner.best_training_job()


METRIC = "episode_reward_mean"


@pytest.fixture(scope="module")
def tuned(workplace):
    """One search, which others begin with."""
    ranges = {"lr": ContinuousParameter(0.0, 1.0), "layers": CategoricalParameter([3])}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(workplace)
        tuner = HyperparameterTuner(estimator_of("train.py"), METRIC, ranges, max_jobs=2, max_parallel_jobs=2)
        tuner.fit(job_name="parent")
    return tuner


@pytest.fixture
def parent(estimator, tuned):
    return tuned


def test_a_search_begins_with_the_jobs_of_an_earlier_one(parent, capsys):
    child = parent.identical_dataset_and_algorithm_tuner()
    assert child.warm_start_config.parents == {"parent"}
    child.max_jobs = 1
    child.fit(job_name="child")
    assert "child: begins with 2 jobs of parent" in capsys.readouterr().out
    rows = child.analytics().rows()
    assert [row["TrainingJobName"] for row in rows] == ["child-002"], "its own jobs, beside the two of before"
    assert child.best_training_job() == "child-002"
    told = child.describe()
    assert told["TrainingJobStatusCounters"] == {"Completed": 1}
    everyone = [*parent.analytics().rows(), *rows]
    best = max(everyone, key=lambda row: row["FinalObjectiveValue"])
    assert told["OverallBestTrainingJob"]["TrainingJobName"] == best["TrainingJobName"]
    grandchild = HyperparameterTuner.attach("child").identical_dataset_and_algorithm_tuner({"parent"})
    grandchild.max_jobs = 1
    grandchild.fit(job_name="grandchild")
    assert "grandchild: begins with 3 jobs of child" in (out := capsys.readouterr().out)
    assert "grandchild: begins with 0 jobs of parent" in out, "the child had told them"


def test_jobs_outside_the_new_ranges_are_left(parent, estimator, capsys):
    far = {"lr": ContinuousParameter(2.0, 3.0), "layers": CategoricalParameter([3])}
    config = WarmStartConfig(WarmStartTypes.TRANSFER_LEARNING, {"parent"})
    tuner = HyperparameterTuner(estimator, METRIC, far, max_jobs=1, warm_start_config=config)
    tuner.fit()
    assert "begins with 0 jobs of parent" in capsys.readouterr().out
    assert "OverallBestTrainingJob" not in tuner.describe(), "figures of other data are not compared"


def test_an_earlier_search_is_attached_and_analysed_by_its_name(parent):
    again = HyperparameterTuner.attach("parent")
    assert again.best_training_job() == parent.best_training_job()
    assert again.estimator.hyperparameters()["lr"] == 9.0, "what the estimator had, not what a job was given"
    analytics = HyperparameterTuningJobAnalytics("parent", sagemaker_session=None)
    assert analytics.rows() == parent.analytics().rows()
    assert analytics.tuning_ranges == {
        "lr": {"MinValue": "0.0", "MaxValue": "1.0", "ScalingType": "Auto"},
        "layers": ["3"],
    }
    first = analytics.rows()[0]
    assert 0 < (first["TrainingEndTime"] - first["TrainingStartTime"]).total_seconds() < 600
    limits = analytics.description()["HyperParameterTuningJobConfig"]["ResourceLimits"]
    assert limits == {"MaxNumberOfTrainingJobs": 2, "MaxParallelTrainingJobs": 2}


def test_what_a_search_cannot_begin_with_is_named(parent, estimator, workplace):
    ranges, kinds = {"lr": ContinuousParameter(0.0, 1.0)}, WarmStartTypes

    def begun(kind, parents, estimator=estimator, **words):
        config = WarmStartConfig(kind, parents)
        return HyperparameterTuner(estimator, METRIC, ranges, warm_start_config=config, **words)

    with pytest.raises(SettingError, match=r"No search is named 'parnet'.*There are .*parent.* Did you mean 'parent'"):
        begun(kinds.TRANSFER_LEARNING, {"parnet"})
    with pytest.raises(SettingError, match="had objective_type 'Maximize' and this one has 'Minimize'"):
        begun(kinds.TRANSFER_LEARNING, {"parent"}, objective_type="Minimize")
    (workplace / "other.py").write_text(SCRIPT)
    other = estimator_of("other.py")
    with pytest.raises(SettingError, match=r"trained .*train.py and this one trains .*other.py"):
        begun(kinds.IDENTICAL_DATA_AND_ALGORITHM, {"parent"}, other)
    assert begun(kinds.TRANSFER_LEARNING, {"parent"}, other).estimator is other


@pytest.mark.usefixtures("understood")
def test_what_was_taken_over_does_not_count_as_tried(home, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    asked = ["--param", "ppo.epochs=1..2", "--json", "gym", "train", "CartPole-v1", *TINY]
    assert CliRunner().invoke(app, ["tune", "--run", "first", "--trials", "2", *asked]).exit_code == 0
    for trials, in_all in (("1", 3), ("1", 3), ("2", 4)):
        done = CliRunner().invoke(app, ["tune", "--run", "second", "--from", "first", "--trials", trials, *asked])
        assert json.loads(done.stdout.splitlines()[-1])["trials"] == in_all, done.output
    told = json.loads((tmp_path / "second" / "tuning.json").read_text())["trials"]
    assert [one["taken_from"] for one in told] == ["first/0", "first/1", "", ""]
    assert "from first/1" in (tmp_path / "second" / "tuning.html").read_text()
