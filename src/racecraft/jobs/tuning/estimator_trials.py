"""`HyperparameterTuner`: SageMaker's search for hyperparameters, over jobs of `RLEstimator`. Begin with `fit`.

Names and shapes are the SDK's (facts: battlesnake-and-sagemaker-rl.md C). What is varied becomes hyperparameters of a
job each; what counts is a metric that the estimator's definitions find in its log.
"""

from __future__ import annotations

import re
import secrets
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import MissingExtraError, SettingError, nearest
from racecraft.formats.tuning import COMPLETE, TrialRecord
from racecraft.formats.whole import make_folder
from racecraft.jobs.estimator import RLEstimator, TrainingJob
from racecraft.jobs.estimator_words import TUNER_ARGUMENTS
from racecraft.jobs.home import JobHome
from racecraft.jobs.metrics import check_definitions
from racecraft.jobs.tuning.search import Standing, search
from racecraft.jobs.tuning.space import Parameter
from racecraft.jobs.tuning.study import Study

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]

    from racecraft.jobs.endpoint import Predictor

STRATEGIES = {"Bayesian": "tpe", "Random": "random", "Grid": "grid", "Hyperband": "tpe"}
PRUNERS = {"Off": "none", "Auto": "median"}
AIMS = {"Maximize": True, "Minimize": False}
FOLDER = "tunings"
"""Where searches lie, in the folder of the jobs."""


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
        recorded: Whatever else the SDK takes; said to have no meaning here.

    Raises:
        SettingError: An unknown word, metric or strategy.
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
        for word in sorted(recorded):
            warnings.warn(
                f"HyperparameterTuner: {word} has no meaning on this machine and is not followed", stacklevel=2
            )
        self.metric_definitions = definitions
        self.max_jobs, self.max_parallel_jobs = max_jobs, max_parallel_jobs
        self.latest_tuning_job: TuningJob | None = None
        self._ranges, self._seed = dict(hyperparameter_ranges), random_seed
        self._maximise = AIMS[objective_type]
        self._sampler = STRATEGIES[strategy]
        self._pruner = "hyperband" if strategy == "Hyperband" else PRUNERS[early_stopping_type]
        self._base = base_tuning_job_name or estimator.base_job_name or Path(estimator.entry_point).stem
        self._study: Study | None = None
        self._jobs: dict[int, str] = {}

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
        home = JobHome.of_user()
        name = job_name or _stamped(self._base)
        folder = home.path / FOLDER / name
        make_folder(folder)
        self._study = Study(folder, self._ranges, self._maximise, self._sampler, self._pruner, self._seed)
        self.latest_tuning_job = TuningJob(name, folder)

        def launch(number: int, values: Mapping[str, Any]) -> _EstimatorTrial:
            self._jobs[number] = f"{name}-{number:03}"
            return self._begin(self._jobs[number], values, inputs)

        search(self._study, launch, self.max_jobs, self.max_parallel_jobs, self._say)

    def wait(self) -> None:
        """Return at once: `fit` has waited."""

    def best_training_job(self) -> str:
        """Return the name of the job that did best.

        Raises:
            SettingError: No job came to a figure.
        """
        return self._jobs[self._best().number]

    def best_estimator(self) -> RLEstimator:
        """Return the estimator of the job that did best."""
        return RLEstimator.attach(self.best_training_job())

    def deploy(self, *values: Any, **words: Any) -> Predictor:
        """Put what the best job learned behind HTTP; arguments as for `RLEstimator.deploy`."""
        return self.best_estimator().deploy(*values, **words)

    def analytics(self) -> TuningJobAnalytics:
        """Return every job of the search as a table."""
        return TuningJobAnalytics(self._searched(), self._jobs)

    def describe(self) -> dict[str, Any]:
        """Return what SageMaker's DescribeHyperParameterTuningJob tells of it, as far as it has a meaning here."""
        records = self._searched().trials()
        best = self._searched().best()
        return {
            "HyperParameterTuningJobName": None if self.latest_tuning_job is None else self.latest_tuning_job.name,
            "HyperParameterTuningJobStatus": "Completed",
            "TrainingJobStatusCounters": {"Completed": sum(one.state == COMPLETE for one in records)},
            "BestTrainingJob": None
            if best is None
            else {
                "TrainingJobName": self._jobs[best.number],
                "TunedHyperParameters": {key: str(value) for key, value in best.values.items()},
                "FinalHyperParameterTuningJobObjectiveMetric": {
                    "MetricName": self.objective_metric_name,
                    "Value": best.score,
                },
            },
        }

    def _begin(self, name: str, values: Mapping[str, Any], inputs: Any) -> _EstimatorTrial:
        made = self.estimator.with_hyperparameters(values, self.metric_definitions)
        made.fit(inputs, wait=False, job_name=name)
        return _EstimatorTrial(name, self.objective_metric_name)

    def _say(self, one: TrialRecord) -> None:
        values = ", ".join(f"{name}={value}" for name, value in one.values.items())
        print(f"{self._jobs[one.number]}: {one.state}, {self.objective_metric_name} {one.score}, {values}", flush=True)

    def _best(self) -> TrialRecord:
        best = self._searched().best()
        if best is None:
            raise SettingError("No job of the search came to a figure; expected one. analytics() says how each ended.")
        return best

    def _searched(self) -> Study:
        if self._study is None:
            raise SettingError("The tuner has searched nothing yet; expected fit() first.")
        return self._study


class TuningJob:
    """One search."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = self.job_name = name
        self.folder = folder


class TuningJobAnalytics:
    """The jobs of a search as a table, as `sagemaker.analytics` has it."""

    def __init__(self, study: Study, jobs: Mapping[int, str]) -> None:
        self._study, self._jobs = study, jobs

    def rows(self) -> list[dict[str, Any]]:
        """Return a row a job, its hyperparameters first."""
        return [
            {
                **one.values,
                "TrainingJobName": self._jobs.get(one.number, ""),
                "TrainingJobStatus": {"complete": "Completed", "failed": "Failed", "pruned": "Stopped"}.get(
                    one.state, "InProgress"
                ),
                "FinalObjectiveValue": one.score,
                "TrainingElapsedTimeSeconds": one.seconds,
            }
            for one in self._study.trials()
        ]

    def dataframe(self, force_refresh: bool = False) -> pd.DataFrame:
        """Return the rows as a data frame.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise MissingExtraError("A data frame needs pandas: pip install 'racecraft[pandas]'.") from error
        return pd.DataFrame(self.rows())


class _EstimatorTrial:
    """One job under way."""

    def __init__(self, name: str, metric: str) -> None:
        self._job, self._metric = TrainingJob(name, JobHome.of_user()), metric

    def look(self) -> Standing:
        told = self._job.describe()
        figures = [point.value for point in self._job.metrics() if point.name == self._metric]
        ended = told["TrainingJobStatus"] in ("Completed", "Failed", "Stopped")
        return Standing(tuple(enumerate(figures, 1)), ended, told["FailureReason"])

    def stop(self) -> None:
        self._job.stop()


def _require(word: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise SettingError(f"{word} is {value!r}; expected one of {', '.join(known)}. {nearest(value, known)}")


def _stamped(base: str) -> str:
    legal = re.sub(r"[^A-Za-z0-9]+", "-", base).strip("-") or "tuning"
    return f"{legal[:36]}-{time.strftime('%y%m%d-%H%M', time.gmtime())}-{secrets.token_hex(2)}"
