"""The jobs of a search as a table, as `sagemaker.analytics` has it."""

from __future__ import annotations

import datetime
from typing import TYPE_CHECKING, Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import MissingExtraError
from racecraft.formats.tuning import TrialRecord
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.states import JobError
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, Parameter
from racecraft.jobs.tuning.study import Study
from racecraft.sagemaker.estimator import TrainingJob
from racecraft.sagemaker.estimator_config import ANALYTICS_ARGUMENTS
from racecraft.sagemaker.tuner_request import RANGES, folder_of, job_of, read_request

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]

TRIAL_STATUS_NAMES = {"complete": "Completed", "failed": "Failed", "pruned": "Stopped"}


class HyperparameterTuningJobAnalytics:
    """What a search has tried.

    Args:
        hyperparameter_tuning_job_name: Which.
        recorded: Whatever else the SDK takes; of no meaning here.

    Raises:
        SettingError: There is no search of that name.
    """

    def __init__(self, hyperparameter_tuning_job_name: str, **recorded: Any) -> None:
        known = (*ANALYTICS_ARGUMENTS, *names_of(HyperparameterTuningJobAnalytics))
        require_arguments("HyperparameterTuningJobAnalytics", recorded, known)
        self.name = hyperparameter_tuning_job_name
        self._asked = read_request(self.name).tuner
        ranges, aim = self._asked[RANGES], self._asked["objective_type"]
        self._study = Study(folder_of(self.name), ranges, maximise=aim == "Maximize")

    @property
    def tuning_ranges(self) -> dict[str, Any]:
        """What was varied, by name: the least and the greatest value, or the values."""
        return {name: _range_of(one) for name, one in self._asked[RANGES].items()}

    def rows(self) -> list[dict[str, Any]]:
        """Return a row a job, its hyperparameters first; what was taken over of earlier searches has none."""
        return [self._row(one) for one in self._study.trials() if not one.taken_from]

    def description(self, force_refresh: bool = False) -> dict[str, Any]:
        """Return what the search was asked, in the SDK's words."""
        return {
            "HyperParameterTuningJobName": self.name,
            "HyperParameterTuningJobConfig": {
                "Strategy": self._asked["strategy"],
                "HyperParameterTuningJobObjective": {
                    "Type": self._asked["objective_type"],
                    "MetricName": self._asked["objective_metric_name"],
                },
                "ResourceLimits": {
                    "MaxNumberOfTrainingJobs": self._asked["max_jobs"],
                    "MaxParallelTrainingJobs": self._asked["max_parallel_jobs"],
                },
            },
        }

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

    def clear_cache(self) -> None:
        """Do nothing: every table is read anew."""

    def _row(self, one: TrialRecord) -> dict[str, Any]:
        job = job_of(self.name, one.number)
        try:
            description = TrainingJob(job, JobPaths.of_user()).describe()
        except JobError:  # deleted since, or never begun
            description = {"CreationTime": None, "TrainingEndTime": None}
        return {
            **one.values,
            "TrainingJobName": job,
            "TrainingJobStatus": TRIAL_STATUS_NAMES.get(one.state, "InProgress"),
            "FinalObjectiveValue": one.score,
            "TrainingStartTime": _moment(description["CreationTime"]),
            "TrainingEndTime": _moment(description["TrainingEndTime"]),
            "TrainingElapsedTimeSeconds": one.seconds,
        }


def _moment(seconds: float | None) -> datetime.datetime | None:
    return None if seconds is None else datetime.datetime.fromtimestamp(seconds, datetime.UTC)


def _range_of(one: Parameter) -> Any:
    """Return a range as SageMaker tells it: numbers as text."""
    if isinstance(one, CategoricalParameter):
        return [str(value) for value in one.values]
    kind = float if isinstance(one, ContinuousParameter) else int
    return {"MinValue": str(kind(one.min_value)), "MaxValue": str(kind(one.max_value)), "ScalingType": one.scaling_type}
