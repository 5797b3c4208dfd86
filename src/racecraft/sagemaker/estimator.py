"""`RLEstimator`: SageMaker's way to train, on this machine's own jobs. Begin with `RLEstimator.fit`.

What is asked becomes a job in the store: a script in folders of its own (`container.py`), as `racecraft run` runs it.
The names and shapes are those of the SDK (facts: battlesnake-and-sagemaker-rl.md C.1); `estimator_config.py` has them.
"""

from __future__ import annotations

import re
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import MissingExtraError, RacecraftError, SettingError
from racecraft.formats.job_spec import JobSpec, require_legal_name
from racecraft.jobs.follow import follow
from racecraft.jobs.hyperparameters import check_overrides
from racecraft.jobs.job import Job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.metrics import MetricPoint, check_definitions, read_metrics
from racecraft.jobs.store import NameTakenError, get
from racecraft.jobs.submit import environment_here, request_stop, require_free, submit
from racecraft.sagemaker.container import channels_of, check_code, container_in, make_job_folders
from racecraft.sagemaker.estimator_config import (
    ANALYTICS_ARGUMENTS,
    DEPLOY_ARGUMENTS,
    ONLY_RECORDED,
    RLToolkit,
    check_image,
    default_metric_definitions,
    experiment_variables,
    require_known,
    second_names,
)
from racecraft.sagemaker.session import Session, buckets_of

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]

    from racecraft.sagemaker.endpoint import Predictor

MAX_SOURCE_CHARACTERS = 63
LENT = ("sagemaker_rl",)
"""Dependencies that need not be there: `racecraft run` lends them."""
_OWN_WORDS = (
    "entry_point", "toolkit", "toolkit_version", "framework", "source_dir", "hyperparameters", "base_job_name",
    "max_run", "max_wait", "use_spot_instances", "metric_definitions", "environment", "dependencies", "cores",
    "memory_mib",
)  # fmt: skip


class UnexpectedStatusException(RacecraftError):  # noqa: N818 - the SDK's name
    """A job that was waited for did not complete."""


class TrainingJob:
    """One job of an estimator.

    Args:
        name: Its name.
        home: Where it lies.
    """

    def __init__(self, name: str, home: JobPaths) -> None:
        self.name = self.job_name = name
        self._home = home

    def describe(self) -> dict[str, Any]:
        """Return what SageMaker's DescribeTrainingJob tells of it."""
        job = self._job()
        recorded = job.spec.recorded
        return {
            "TrainingJobName": job.name,
            "TrainingJobStatus": job.status,
            "SecondaryStatus": job.state.value,
            "FailureReason": job.reason if job.status == "Failed" else "",
            "HyperParameters": dict(recorded.get("hyperparameters", {})),
            "ModelArtifacts": {"S3ModelArtifacts": str(container_in(self._home.folder(job.name)).model_data)},
            "CreationTime": job.created,
            "TrainingEndTime": job.ended_at,
            "TrainingTimeInSeconds": round(job.training_seconds(time.time())),
            "StoppingCondition": {"MaxRuntimeInSeconds": job.spec.max_run_seconds},
            "EnableManagedSpotTraining": job.spec.use_spot_instances,
            "SecondaryStatusTransitions": [
                {"Status": step.state.value, "StartTime": step.time, "StatusMessage": step.message}
                for step in job.transitions
            ],
            "FinalMetricDataList": [
                {"MetricName": name, "Value": point.value, "Timestamp": point.time}
                for name, point in {point.name: point for point in self.metrics()}.items()
            ],
            "Recorded": dict(recorded),
        }

    def metrics(self) -> list[MetricPoint]:
        """Return what its metric definitions find in its log, in order."""
        spec = self._job().spec
        return read_metrics(self._home.log(self.name), self._home.log_times(self.name), spec.metric_definitions)

    def wait(self, logs: str | bool | None = "All") -> None:
        """Wait until it has ended; with logs, say what it says.

        Raises:
            UnexpectedStatusException: It failed.
        """
        store = self._home.store()
        try:
            for text in follow(self._home.log(self.name), lambda: get(store, self.name).ended):
                if logs and logs != "None":
                    sys.stdout.write(text)
                    sys.stdout.flush()
            job = get(store, self.name)
        finally:
            store.close()
        if job.status == "Failed":
            raise UnexpectedStatusException(
                "Error for Training job {name}: Failed. Reason: {reason}", name=job.name, reason=job.reason
            )

    def stop(self) -> None:
        """Ask it to end."""
        store = self._home.store()
        try:
            request_stop(self._home, store, self.name)
        finally:
            store.close()

    def _job(self) -> Job:
        store = self._home.store()
        try:
            return get(store, self.name)
        finally:
            store.close()


class TrainingJobAnalytics:
    """A job's metrics as a table, as `sagemaker.analytics` has it."""

    def __init__(self, training_job_name: str, metric_names: Sequence[str] | None = None, **recorded: Any) -> None:
        require_arguments("TrainingJobAnalytics", recorded, (*ANALYTICS_ARGUMENTS, *names_of(TrainingJobAnalytics)))
        self._job, self._names = TrainingJob(training_job_name, JobPaths.of_user()), metric_names

    def rows(self) -> list[dict[str, Any]]:
        """Return (seconds since the first figure, metric, value), a row a figure."""
        points = [one for one in self._job.metrics() if self._names is None or one.name in self._names]
        begin = points[0].time if points else 0.0
        return [
            {"timestamp": round(one.time - begin, 2), "metric_name": one.name, "value": one.value} for one in points
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
        return pd.DataFrame(self.rows(), columns=["timestamp", "metric_name", "value"])

    def export_csv(self, filename: str) -> None:
        """Write the rows as a CSV file."""
        lines = [f"{at},{row['timestamp']},{row['metric_name']},{row['value']}" for at, row in enumerate(self.rows())]
        Path(filename).write_text("\n".join([",timestamp,metric_name,value", *lines]) + "\n", encoding="utf-8")


class RLEstimator:
    """Trains a script, as SageMaker's does.

    Args:
        entry_point: The script; in `source_dir` where there is one.
        toolkit: What it was written for; recorded.
        toolkit_version: The same.
        framework: The same.
        source_dir: Folder that is laid beside it.
        hyperparameters: Become its arguments, and SM_HP_… variables.
        image_uri: An image instead of a toolkit; recorded.
        metric_definitions: {"Name", "Regex"}, read out of the log; None: the toolkit's own.
        words: Whatever else either version of the SDK takes. `max_run`, `max_wait`, `use_spot_instances`,
            `dependencies`, `environment` and `base_job_name` do here what they do there; `cores` and `memory_mib`,
            ours, say what the job takes of this machine (by default all its cores, of a secondary none); the others
            are recorded.

    Raises:
        SettingError: An unknown word or hyperparameter; the nearest known one is told.
        CodeError: The script or its folders are not there.
        ImageMissingError: Neither an image nor a whole toolkit is named.
    """

    def __init__(
        self,
        entry_point: str,
        toolkit: Any = None,
        toolkit_version: str | None = None,
        framework: Any = None,
        source_dir: str | None = None,
        hyperparameters: Mapping[str, Any] | None = None,
        image_uri: str | None = None,
        metric_definitions: Sequence[Mapping[str, str]] | None = None,
        **words: Any,
    ) -> None:
        given = second_names({**({} if image_uri is None else {"image_uri": image_uri}), **words})
        image = given.pop("image_uri", None)
        require_known(given, (*_OWN_WORDS, *ONLY_RECORDED))
        self.image = check_image(image, toolkit, toolkit_version, framework)
        self.entry_point, self.source_dir = str(entry_point), source_dir
        self.dependencies = check_code(self.entry_point, source_dir, given.pop("dependencies", None) or (), LENT)
        if metric_definitions is None and image is None:
            metric_definitions = default_metric_definitions(toolkit)
        self.metric_definitions = check_definitions(metric_definitions or ())
        self._hyperparameters = dict(hyperparameters or {})
        for note in check_overrides(self._hyperparameters):
            warnings.warn(note, stacklevel=2)
        self.base_job_name = given.pop("base_job_name", None)
        self.max_run: int | None = given.pop("max_run", None)
        self.max_wait: int | None = given.pop("max_wait", None)
        self.use_spot_instances = bool(given.pop("use_spot_instances", False))
        if self.max_wait is not None and self.max_run is not None and self.max_wait < self.max_run:
            raise SettingError(
                "RLEstimator: max_wait {max_wait} is less than max_run {max_run}.",
                max_wait=self.max_wait,
                max_run=self.max_run,
            )
        self.environment = {str(name): str(value) for name, value in (given.pop("environment", None) or {}).items()}
        self.cores: int | None = given.pop("cores", None)
        self.memory_mib: int = given.pop("memory_mib", 1024)
        self.recorded = {name: _recordable(value) for name, value in given.items()}
        self.sagemaker_session = given.get("sagemaker_session") or Session()
        self.latest_training_job: TrainingJob | None = None
        self._home = JobPaths.of_user()

    @classmethod
    def default_metric_definitions(cls, toolkit: RLToolkit | str) -> list[dict[str, str]]:
        """Return the metrics that a toolkit's log is searched for."""
        return default_metric_definitions(toolkit)

    @classmethod
    def attach(cls, training_job_name: str, sagemaker_session: Any = None) -> RLEstimator:
        """Return the estimator of a job that was begun earlier.

        Raises:
            JobError: There is no such job.
            SettingError: It is none of an estimator's.
        """
        job = TrainingJob(training_job_name, JobPaths.of_user())
        recorded = job.describe()["Recorded"].get("estimator")
        if recorded is None:
            raise SettingError(
                "Job {training_job_name} was not begun by an estimator; expected one that was.",
                training_job_name=training_job_name,
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is worth saying was said when the job began
            found = cls(**recorded)
        found.latest_training_job = job
        return found

    def with_hyperparameters(
        self, more: Mapping[str, Any], metric_definitions: Sequence[Mapping[str, str]] | None = None
    ) -> RLEstimator:
        """Return an estimator like this one, with further hyperparameters, or other values of those it has.

        Raises:
            SettingError: A hyperparameter is unknown.
        """
        recorded = {name: value for name, value in self.recorded.items() if name != "sagemaker_session"}
        words = {**recorded, **self.words(), "hyperparameters": {**self._hyperparameters, **more}}
        if metric_definitions is not None:
            words["metric_definitions"] = list(metric_definitions)
        return RLEstimator(**words)

    def hyperparameters(self) -> dict[str, Any]:
        """Return what the script is told, the SDK's own additions among it."""
        return {**self._hyperparameters, "sagemaker_estimator": "RLEstimator"}

    def fit(
        self,
        inputs: Any = None,
        wait: bool = True,
        logs: str | bool | None = "All",
        job_name: str | None = None,
        experiment_config: Mapping[str, str] | None = None,
    ) -> None:
        """Begin a job, and wait for it.

        Args:
            inputs: What the script finds under opt/ml/input/data: an address, or {"channel": address}.
            wait: Whether to wait for its end.
            logs: Whether what it says is said here, too, while it is waited for.
            job_name: Its name; None: `base_job_name` and the time.
            experiment_config: Recorded; MLflow is told it, where a training of the job's tells MLflow.

        Raises:
            NameTakenError: There is a job of that name.
            ChannelError: An input is not there.
            UnexpectedStatusException: It was waited for, and failed.
        """
        name = require_legal_name(job_name or self._job_name())
        channels = channels_of(inputs, buckets_of(self._home))
        require_free(self._home, name)
        hyperparameters = {**self.hyperparameters(), "sagemaker_program": self._program(), "sagemaker_job_name": name}
        try:
            make_job_folders(
                self._home.folder(name), self.entry_point, self.source_dir, self.dependencies, hyperparameters, channels
            )
            submit(self._home, self._spec(name, channels, experiment_config))
        except NameTakenError:
            raise  # somebody was quicker, and the folder is theirs
        except BaseException:
            self._home.delete(name)
            raise
        self.latest_training_job = TrainingJob(name, self._home)
        if wait:
            self.latest_training_job.wait(logs)

    @property
    def model_data(self) -> str:
        """Where the latest job's model.tar.gz lies.

        Raises:
            SettingError: Nothing was trained yet, or nothing was left yet.
        """
        path = container_in(self._home.folder(self._latest().name)).model_data
        if not path.is_file():
            raise SettingError(
                "Job {name} has left no model yet; expected {path}. Wait for its end.",
                name=self._latest().name,
                path=path,
            )
        return str(path)

    @property
    def training_job_analytics(self) -> TrainingJobAnalytics:
        """The latest job's metrics as a table."""
        return TrainingJobAnalytics(self._latest().name)

    def deploy(
        self,
        initial_instance_count: int = 1,
        instance_type: str = "local",
        serializer: Any = None,
        deserializer: Any = None,
        endpoint_name: str | None = None,
        wait: bool = True,
        policy: str = "",
        trust_model: bool = False,
        **recorded: Any,
    ) -> Predictor:
        """Put what the latest job learned behind HTTP, as `Model.deploy`; return who asks it.

        Raises:
            EndpointError: Nothing that racecraft trained lies in the job's model, or the name is taken.
            SettingError: An argument that no version of the SDK has.
        """
        require_arguments("deploy", recorded, (*DEPLOY_ARGUMENTS, *names_of(self.deploy)))
        from racecraft.sagemaker.endpoint import deploy, trained_run_in
        from racecraft.sagemaker.model_code import model_code

        code = model_code(recorded)
        model = container_in(self._home.folder(self._latest().name)).model
        served = model if code else trained_run_in(model)
        name = endpoint_name or self._job_name()
        return deploy(self._home, served, name, serializer, deserializer, wait, policy, code, trust_model)

    def _spec(self, name: str, channels: Mapping[str, Path], experiment: Mapping[str, str] | None) -> JobSpec:
        folder = self._home.folder(name)
        return JobSpec(
            ("jobs", "enter", str(folder)),
            name,
            folder=str(folder),
            environment={**environment_here(), **experiment_variables(experiment), **self.environment},
            cores=self._cores(),
            memory_mib=self.memory_mib,
            max_run_seconds=self.max_run,
            max_wait_seconds=self.max_wait,
            use_spot_instances=self.use_spot_instances,
            metric_definitions=self.metric_definitions,
            recorded={
                **self.recorded,
                **self.image,
                "hyperparameters": self._hyperparameters,
                "inputs": {channel: str(place) for channel, place in channels.items()},
                "experiment_config": dict(experiment or {}),
                "estimator": self.words(),
            },
        )

    def words(self) -> dict[str, Any]:
        """Return the words that make this estimator once more, as JSON takes them."""
        return {
            "entry_point": str(Path(self.entry_point).absolute()) if self.source_dir is None else self.entry_point,
            "source_dir": None if self.source_dir is None else str(Path(self.source_dir).absolute()),
            "dependencies": [str(Path(one).absolute()) + "/" * one.endswith("/") for one in self.dependencies],
            "hyperparameters": self._hyperparameters,
            "metric_definitions": list(self.metric_definitions),
            "base_job_name": self.base_job_name,
            "max_run": self.max_run,
            "max_wait": self.max_wait,
            "use_spot_instances": self.use_spot_instances,
            "environment": self.environment,
            "cores": self.cores,
            "memory_mib": self.memory_mib,
            **self.image,
        }

    def _latest(self) -> TrainingJob:
        if self.latest_training_job is None:
            raise SettingError("The estimator has trained nothing yet; expected fit() first.")
        return self.latest_training_job

    def _job_name(self) -> str:
        now = time.time()
        stamp = time.strftime("%Y-%m-%d-%H-%M-%S", time.gmtime(now)) + f"-{int(now * 1000) % 1000:03}"
        base = re.sub(r"[^A-Za-z0-9]+", "-", self.base_job_name or Path(self.entry_point).stem).strip("-") or "job"
        return f"{base[: MAX_SOURCE_CHARACTERS - 1 - len(stamp)]}-{stamp}"

    def _program(self) -> str:
        return self.entry_point if self.source_dir is not None else Path(self.entry_point).name

    def _cores(self) -> int | None:
        """Return the cores that the job takes; None: all. A secondary only waits for its primary, and takes none."""
        waits = self.cores is None and self._hyperparameters.get("rl_cluster_type") == "secondary"
        return 0 if waits else self.cores


def _recordable(value: Any) -> Any:
    """Return what a job file can hold of a value that is only recorded."""
    if isinstance(value, str | int | float | bool | None):
        return value
    if isinstance(value, Mapping):
        return {str(name): _recordable(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_recordable(part) for part in value]
    return type(value).__name__
