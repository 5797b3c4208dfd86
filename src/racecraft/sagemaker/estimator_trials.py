"""`HyperparameterTuner`: SageMaker's search for hyperparameters, over jobs of `RLEstimator`. Begin with `fit`.

Names and shapes are the SDK's (facts: battlesnake-and-sagemaker-rl.md C). What is varied becomes hyperparameters of a
job each; what counts is a metric that the estimator's definitions find in its log.
"""

from __future__ import annotations

import re
import secrets
import time
import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.atomic import make_folder
from racecraft.formats.tuning import COMPLETE, TrialRecord, best_of
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.metrics import check_definitions
from racecraft.jobs.tuning.search import TrialStatus, search
from racecraft.jobs.tuning.space import Parameter
from racecraft.jobs.tuning.study import Study
from racecraft.jobs.tuning.warm_start import WarmStartConfig, WarmStartTypes
from racecraft.sagemaker.estimator import RLEstimator, TrainingJob
from racecraft.sagemaker.estimator_config import TUNER_ARGUMENTS
from racecraft.sagemaker.search_analytics import HyperparameterTuningJobAnalytics
from racecraft.sagemaker.tuner_request import RANGES, TunerRequest, folder_of, job_of, read_request, write_request

if TYPE_CHECKING:
    from racecraft.sagemaker.endpoint import Predictor

STRATEGIES = {"Bayesian": "tpe", "Random": "random", "Grid": "grid", "Hyperband": "tpe"}
PRUNERS = {"Off": "none", "Auto": "median"}
AIMS = {"Maximize": True, "Minimize": False}


class HyperparameterTuner:
    """Looks for the hyperparameters with which an estimator's jobs do best.

    Args:
        estimator: What is fitted, again and again.
        objective_metric_name: One of its metric definitions, or of these.
        hyperparameter_ranges: What is varied.
        metric_definitions: {"Name", "Regex"}; None: the estimator's.
        strategy: "Bayesian", "Random", "Grid" or "Hyperband".
        objective_type: "Maximize" or "Minimize".
        max_jobs: How many jobs in all.
        max_parallel_jobs: How many at a time.
        early_stopping_type: "Auto": jobs worse than half of the others are stopped; or "Off".
        base_tuning_job_name: Of the search; None: the estimator's.
        random_seed: Of the sampler.
        warm_start_config: Earlier searches, of whose jobs those within these ranges say what is tried next.
        recorded: Whatever else the SDK takes; said to have no meaning here.

    Raises:
        SettingError: An unknown word, metric, strategy or earlier search; one that had another metric in mind.
        MissingExtraError: Optuna is not installed.
    """

    def __init__(
        self,
        estimator: RLEstimator,
        objective_metric_name: str,
        hyperparameter_ranges: Mapping[str, Parameter],
        metric_definitions: Sequence[Mapping[str, str]] | None = None,
        strategy: str = "Bayesian",
        objective_type: str = "Maximize",
        max_jobs: int = 1,
        max_parallel_jobs: int = 1,
        early_stopping_type: str = "Off",
        base_tuning_job_name: str | None = None,
        random_seed: int = 0,
        warm_start_config: WarmStartConfig | None = None,
        **recorded: Any,
    ) -> None:
        known = (*TUNER_ARGUMENTS, *names_of(HyperparameterTuner))
        require_arguments("HyperparameterTuner", recorded, known)
        self.estimator, self.objective_metric_name = estimator, objective_metric_name
        definitions = check_definitions(metric_definitions) if metric_definitions else estimator.metric_definitions
        names = [one["Name"] for one in definitions]
        _require("objective_metric_name", objective_metric_name, names)
        _require("strategy", strategy, list(STRATEGIES))
        _require("objective_type", objective_type, list(AIMS))
        _require("early_stopping_type", early_stopping_type, list(PRUNERS))
        if not hyperparameter_ranges:
            raise SettingError("hyperparameter_ranges is empty; expected what is varied, such as {'lr': …}.")
        if not isinstance(warm_start_config, WarmStartConfig | None):
            raise SettingError(
                "warm_start_config is {warm_start_config!r}; expected a WarmStartConfig, or None.",
                warm_start_config=warm_start_config,
            )
        for word in sorted(recorded):
            warnings.warn(
                f"HyperparameterTuner: {word} has no meaning on this machine and is not followed", stacklevel=2
            )
        self.metric_definitions = definitions
        self.strategy, self.objective_type, self.early_stopping_type = strategy, objective_type, early_stopping_type
        self.max_jobs, self.max_parallel_jobs, self.random_seed = max_jobs, max_parallel_jobs, random_seed
        self.base_tuning_job_name = base_tuning_job_name
        self.warm_start_config = warm_start_config
        self.latest_tuning_job: TuningJob | None = None
        self._ranges = dict(hyperparameter_ranges)
        self._study: Study | None = None
        for parent in self._parents():
            self._require_comparable(parent)

    @classmethod
    def attach(cls, tuning_job_name: str, sagemaker_session: Any = None) -> HyperparameterTuner:
        """Return the tuner of a search that was made earlier.

        Raises:
            SettingError: There is no search of that name.
        """
        request = read_request(tuning_job_name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is worth saying was said when it searched
            found = cls(RLEstimator(**request.estimator), **request.tuner)
        folder = folder_of(tuning_job_name)
        found.latest_tuning_job, found._study = TuningJob(tuning_job_name, folder), found._study_in(folder)
        return found

    def identical_dataset_and_algorithm_tuner(
        self, additional_parents: Collection[str] | None = None
    ) -> HyperparameterTuner:
        """Return a tuner that goes on where this one, and others, ended: with the same script and data.

        Raises:
            SettingError: This one has not searched yet.
        """
        return self._next(WarmStartTypes.IDENTICAL_DATA_AND_ALGORITHM, additional_parents, self.estimator)

    def transfer_learning_tuner(
        self, additional_parents: Collection[str] | None = None, estimator: RLEstimator | None = None
    ) -> HyperparameterTuner:
        """Return a tuner that begins with what this one, and others, found: with other data or another estimator.

        Raises:
            SettingError: This one has not searched yet.
        """
        return self._next(WarmStartTypes.TRANSFER_LEARNING, additional_parents, estimator or self.estimator)

    def fit(self, inputs: Any = None, job_name: str | None = None, wait: bool = True, logs: Any = None) -> None:
        """Search; what each job came to is said as it ends.

        Args:
            inputs: As for `RLEstimator.fit`.
            job_name: Of the search; None: its base name and the time.
            wait: The search is looked after by this process, so it is waited for in any case.
            logs: Not said here; `racecraft jobs logs JOB` says them.

        Raises:
            TuningError: The first jobs all failed.
        """
        if not wait:
            warnings.warn("a search lives in this process, so fit(wait=False) waits as well", stacklevel=2)
        base = self.base_tuning_job_name or self.estimator.base_job_name or Path(self.estimator.entry_point).stem
        name = job_name or _stamped(base)
        folder = folder_of(name)
        make_folder(folder)
        write_request(folder, TunerRequest(self.estimator.words(), self._words()))
        self._study = self._study_in(folder)
        self.latest_tuning_job = TuningJob(name, folder)
        for parent in self._parents():
            taken = self._study.take_over(folder_of(parent))
            print(f"{name}: begins with {taken} jobs of {parent}", flush=True)

        def launch(number: int, values: Mapping[str, Any]) -> _EstimatorTrial:
            return self._begin(job_of(name, number), values, inputs)

        def find(number: int) -> _EstimatorTrial | None:
            job = job_of(name, number)
            return _EstimatorTrial(job, self.objective_metric_name) if _is_job(job) else None

        search(self._study, launch, self.max_jobs, self.max_parallel_jobs, self._say, find=find)

    def wait(self) -> None:
        """Return at once: `fit` has waited."""

    def best_training_job(self) -> str:
        """Return the name of the job that did best.

        Raises:
            SettingError: No job came to a figure.
        """
        return self._job(self._best())

    def best_estimator(self) -> RLEstimator:
        """Return the estimator of the job that did best."""
        return RLEstimator.attach(self.best_training_job())

    def deploy(self, *values: Any, **words: Any) -> Predictor:
        """Put what the best job learned behind HTTP; arguments as for `RLEstimator.deploy`."""
        return self.best_estimator().deploy(*values, **words)

    def analytics(self) -> HyperparameterTuningJobAnalytics:
        """Return every job of the search as a table."""
        self._searched()
        assert self.latest_tuning_job is not None
        return HyperparameterTuningJobAnalytics(self.latest_tuning_job.name)

    def describe(self) -> dict[str, Any]:
        """Return what SageMaker's DescribeHyperParameterTuningJob tells of it, as far as it has a meaning here.

        "OverallBestTrainingJob", of this search and those it began with, is told where their figures may be compared.
        """
        own = self._tried()
        description = {
            "HyperParameterTuningJobName": None if self.latest_tuning_job is None else self.latest_tuning_job.name,
            "HyperParameterTuningJobStatus": "Completed",
            "TrainingJobStatusCounters": {"Completed": sum(one.state == COMPLETE for one in own)},
            "BestTrainingJob": self._told(best_of(own, AIMS[self.objective_type])),
        }
        warm = self.warm_start_config
        if warm is not None and warm.type is WarmStartTypes.IDENTICAL_DATA_AND_ALGORITHM:
            description["OverallBestTrainingJob"] = self._told(self._searched().best())
        return description

    def _told(self, best: TrialRecord | None) -> dict[str, Any] | None:
        if best is None:
            return None
        return {
            "TrainingJobName": self._job(best),
            "TunedHyperParameters": {key: str(value) for key, value in best.values.items()},
            "FinalHyperParameterTuningJobObjectiveMetric": {
                "MetricName": self.objective_metric_name,
                "Value": best.score,
            },
        }

    def _words(self) -> dict[str, Any]:
        """Return the words that make this tuner once more, beside its estimator; without what it began with."""
        return {
            "objective_metric_name": self.objective_metric_name,
            RANGES: dict(self._ranges),
            "metric_definitions": list(self.metric_definitions),
            "strategy": self.strategy,
            "objective_type": self.objective_type,
            "max_jobs": self.max_jobs,
            "max_parallel_jobs": self.max_parallel_jobs,
            "early_stopping_type": self.early_stopping_type,
            "base_tuning_job_name": self.base_tuning_job_name,
            "random_seed": self.random_seed,
        }

    def _next(
        self, kind: WarmStartTypes, more_parents: Collection[str] | None, estimator: RLEstimator
    ) -> HyperparameterTuner:
        self._searched()
        assert self.latest_tuning_job is not None
        config = WarmStartConfig(kind, {self.latest_tuning_job.name, *(more_parents or ())})
        return HyperparameterTuner(estimator, **self._words(), warm_start_config=config)

    def _parents(self) -> list[str]:
        return [] if self.warm_start_config is None else sorted(self.warm_start_config.parents)

    def _require_comparable(self, parent: str) -> None:
        request = read_request(parent)
        for word in ("objective_metric_name", "objective_type"):
            theirs, ours = request.tuner[word], getattr(self, word)
            if theirs != ours:
                raise SettingError(
                    "warm_start_config: the search {parent} had {word} {theirs!r} and this one has {ours!r}; expected "
                    "the same, for otherwise its figures say nothing here.",
                    parent=parent,
                    word=word,
                    theirs=theirs,
                    ours=ours,
                )
        warm = self.warm_start_config
        assert warm is not None
        script, theirs = self.estimator.words()["entry_point"], request.estimator["entry_point"]
        if warm.type is WarmStartTypes.IDENTICAL_DATA_AND_ALGORITHM and script != theirs:
            raise SettingError(
                "warm_start_config: the search {parent} trained {theirs} and this one trains {script}; expected the "
                "same of IDENTICAL_DATA_AND_ALGORITHM. Name WarmStartTypes.TRANSFER_LEARNING.",
                parent=parent,
                theirs=theirs,
                script=script,
            )

    def _study_in(self, folder: Path) -> Study:
        pruner = "hyperband" if self.strategy == "Hyperband" else PRUNERS[self.early_stopping_type]
        maximise = AIMS[self.objective_type]
        return Study(folder, self._ranges, maximise, STRATEGIES[self.strategy], pruner, self.random_seed)

    def _begin(self, name: str, values: Mapping[str, Any], inputs: Any) -> _EstimatorTrial:
        made = self.estimator.with_hyperparameters(values, self.metric_definitions)
        made.fit(inputs, wait=False, job_name=name)
        return _EstimatorTrial(name, self.objective_metric_name)

    def _say(self, one: TrialRecord) -> None:
        values = ", ".join(f"{name}={value}" for name, value in one.values.items())
        print(f"{self._job(one)}: {one.state}, {self.objective_metric_name} {one.score}, {values}", flush=True)

    def _best(self) -> TrialRecord:
        best = best_of(self._tried(), AIMS[self.objective_type])
        if best is None:
            raise SettingError("No job of the search came to a figure; expected one. analytics() says how each ended.")
        return best

    def _tried(self) -> list[TrialRecord]:
        """Return what this search has tried itself."""
        return [one for one in self._searched().trials() if not one.taken_from]

    def _job(self, one: TrialRecord) -> str:
        """Return the name of a trial's job; of one that was taken over, of the search that tried it."""
        assert self.latest_tuning_job is not None
        search_name, _, number = (one.taken_from or f"{self.latest_tuning_job.name}/{one.number}").rpartition("/")
        return job_of(search_name, int(number))

    def _searched(self) -> Study:
        if self._study is None:
            raise SettingError("The tuner has searched nothing yet; expected fit() first.")
        return self._study


class TuningJob:
    """One search."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = self.job_name = name
        self.folder = folder


def _is_job(name: str) -> bool:
    store = JobPaths.of_user().store()
    try:
        return store.find(name) is not None
    finally:
        store.close()


class _EstimatorTrial:
    """One job under way."""

    def __init__(self, name: str, metric: str) -> None:
        self._job, self._metric = TrainingJob(name, JobPaths.of_user()), metric

    def poll(self) -> TrialStatus:
        description = self._job.describe()
        figures = [point.value for point in self._job.metrics() if point.name == self._metric]
        ended = description["TrainingJobStatus"] in ("Completed", "Failed", "Stopped")
        return TrialStatus(tuple(enumerate(figures, 1)), ended, description["FailureReason"])

    def stop(self) -> None:
        self._job.stop()


def _require(word: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise SettingError(
            "{word} is {value!r}; expected one of {known}. {hint}",
            word=word,
            value=value,
            known=", ".join(known),
            hint=nearest(value, known),
        )


def _stamped(base: str) -> str:
    legal = re.sub(r"[^A-Za-z0-9]+", "-", base).strip("-") or "tuning"
    return f"{legal[:36]}-{time.strftime('%y%m%d-%H%M', time.gmtime())}-{secrets.token_hex(2)}"
