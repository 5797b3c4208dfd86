"""A training as a run of MLflow: settings as params, figures as metrics over environment steps. Begin with `MlflowRun`.

    --set runtime.mlflow=http://127.0.0.1:5000    a server
    --set runtime.mlflow=sqlite:///mlflow.db      a database
    --set runtime.mlflow=true                     MLFLOW_TRACKING_URI, else `mlflow.db` beside the run folder

Metrics have TensorBoard's names. Checkpoints stay where they are: tags and the note say where. A thread of its own
sends, so a server that is slow or gone holds up no tick; what it never took is said at the end.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import MissingExtraError, SettingError
from racecraft.formats.job_spec import EXPERIMENT_VARIABLES
from racecraft.training.callbacks import IterationReport
from racecraft.training.tensorboard import evaluation_points, training_points

EXPERIMENT = "racecraft"
"""The experiment's name where nobody gave one."""
ADDRESSES = ("http://", "https://", "sqlite://", "postgresql://", "mysql://", "mssql://", "databricks")
LAST_SECONDS = 15.0
"""How long the end of a training waits for what is still to be sent."""
PARAMS_AT_ONCE, POINTS_AT_ONCE = 100, 1000
"""MLflow's own limits for one request."""
RUN_TAG, STARTED_TAG = "racecraft.run_folder", "racecraft.started"
"""By both a run that goes on finds itself again."""


@dataclass(frozen=True)
class RunDescription:
    """What MLflow is told of a training before its first tick."""

    folder: Path
    job: Mapping[str, Any]
    """job.json of its run folder."""

    @property
    def experiment(self) -> str:
        """The experiment it belongs to."""
        given = os.environ.get("MLFLOW_EXPERIMENT_NAME") or os.environ.get(EXPERIMENT_VARIABLES["ExperimentName"])
        return given or EXPERIMENT

    @property
    def params(self) -> dict[str, str]:
        """Settings by their full names, and the seed."""
        groups = self.job["settings"]
        named = {f"{group}.{name}": str(value) for group, part in groups.items() for name, value in part.items()}
        named.pop("runtime.mlflow", None)  # it may hold a password
        return {"algorithm": str(self.job["algorithm"]), "seed": str(self.job["seed"]), **named}

    @property
    def tags(self) -> dict[str, str]:
        """Where everything lies, and the names that group runs."""
        folder = self.folder.absolute().as_uri()
        trial = {key: os.environ[name] for key, name in EXPERIMENT_VARIABLES.items() if os.environ.get(name)}
        return {
            RUN_TAG: folder, STARTED_TAG: str(self.job["started"]), "racecraft.kind": str(self.job["kind"]),
            "racecraft.checkpoints": f"{folder}/checkpoints",
            "mlflow.note.content": f"{self.job['title']}: {folder} (checkpoints, episodes and evaluations in it)",
            **{f"sagemaker.{key}": value for key, value in trial.items()},
        }  # fmt: skip


class MlflowRun:
    """Sends what a training tells to MLflow.

    Args:
        address: What `runtime.mlflow` says.
        description: The training.
        on_message: Called with a line for a person.

    Raises:
        MissingExtraError: MLflow is not installed.
        SettingError: The address is none that MLflow knows.
    """

    def __init__(self, address: str, description: RunDescription, on_message: Callable[[str], None]) -> None:
        self._uri = tracking_uri(address, description.folder)
        self._description, self._on_message = description, on_message
        self._client_class = client_class(address)
        self._client: Any = None
        self._id, self._score_name, self._iteration = "", "score", 0
        self._waiting: list[tuple[str, float, int, int]] = []  # name, value, milliseconds, step
        self._trouble, self._is_over = "", False
        self._changed = threading.Condition()
        self._sender = threading.Thread(target=self._send_all, name="mlflow", daemon=True)

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Begin to send."""
        self._score_name = score_name
        self._sender.start()

    def iteration(self, report: IterationReport) -> None:
        """Hand over an iteration's points; of one that is told again, only its evaluation."""
        points = [] if report.iteration == self._iteration else list(training_points(report))
        now = int(time.time() * 1000)
        with self._changed:
            self._waiting += [
                (metric_name(name), float(value), now, report.steps)
                for name, value in [*points, *evaluation_points(report, self._score_name)]
            ]
            self._changed.notify()
        self._iteration = report.iteration

    def end(self, reason: str) -> None:
        """Send the rest, for a while, and say what MLflow did not take."""
        with self._changed:
            self._is_over = True
            self._changed.notify()
        if self._sender.ident is not None:
            self._sender.join(LAST_SECONDS)
        if self._sender.is_alive() or self._waiting or self._trouble:
            steps = {step for *_, step in self._waiting}
            why = self._trouble or f"it did not answer within {LAST_SECONDS:g} s"
            self._on_message(
                f"MLflow at {hidden(self._uri)} did not take the figures of {len(steps)} iterations ({why}); they "
                f"stand in {self._description.folder / 'metrics.jsonl'} all the same"
            )

    def _send_all(self) -> None:
        """Send whenever there is something; after a failure, again with what comes next, and once at the end."""
        while True:
            with self._changed:
                sent, was_over = len(self._waiting), self._is_over
                if not sent and not was_over:
                    self._changed.wait()
                    continue
                points = self._waiting[:POINTS_AT_ONCE]
            try:
                self._send(points, is_last=was_over and sent == len(points))
                self._trouble = ""
            except Exception as cause:  # whatever MLflow and its network raise
                self._trouble = first_line(cause)
                with self._changed:
                    if was_over:
                        return
                    while not self._is_over and len(self._waiting) == sent:
                        self._changed.wait()
                continue
            with self._changed:
                del self._waiting[: len(points)]
                if was_over and not self._waiting:
                    return

    def _send(self, points: list[tuple[str, float, int, int]], is_last: bool) -> None:
        from mlflow.entities import Metric

        if self._client is None:
            client = self._client_class(tracking_uri=self._uri)
            self._id = open_run(client, self._description)
            self._client = client
        if points:
            self._client.log_batch(self._id, metrics=[Metric(*point) for point in points])
        if is_last:
            self._client.set_terminated(self._id, "FINISHED")


def open_run(client: Any, description: RunDescription) -> str:
    """Return the id of MLflow's run of a training: the one it had before, else a new one with params and tags."""
    from mlflow.entities import Param

    found = client.get_experiment_by_name(description.experiment)
    experiment = found.experiment_id if found else client.create_experiment(description.experiment)
    tags = description.tags
    mine = f"tags.`{RUN_TAG}` = '{tags[RUN_TAG]}' and tags.`{STARTED_TAG}` = '{tags[STARTED_TAG]}'"
    for run in client.search_runs([experiment], mine, max_results=1):
        client.set_terminated(run.info.run_id, "RUNNING")
        return str(run.info.run_id)
    name = os.environ.get(EXPERIMENT_VARIABLES["TrialComponentDisplayName"]) or description.folder.name
    run_id = str(client.create_run(experiment, tags=tags, run_name=name).info.run_id)
    params = [Param(key, value) for key, value in description.params.items()]
    for first in range(0, len(params), PARAMS_AT_ONCE):
        client.log_batch(run_id, params=params[first : first + PARAMS_AT_ONCE])
    return run_id


def tracking_uri(address: str, folder: Path) -> str:
    """Return MLflow's address.

    Args:
        address: What `runtime.mlflow` says.
        folder: The run's.

    Raises:
        SettingError: It is none that MLflow knows.

    >>> tracking_uri("sqlite:///a.db", Path("runs/x"))
    'sqlite:///a.db'
    """
    if address == "true":
        beside = f"sqlite:///{folder.absolute().parent / 'mlflow.db'}"
        return os.environ.get("MLFLOW_TRACKING_URI") or beside
    if not address.startswith(ADDRESSES):
        raise SettingError(
            "runtime.mlflow={address}: no address of MLflow; expected true, http://HOST:PORT or sqlite:///FILE. "
            "(Its folders of files are no longer kept up by MLflow itself.)",
            address=address,
        )
    return address


def client_class(address: str) -> Any:
    """Return MLflow's client, with its reports home switched off.

    Raises:
        MissingExtraError: It is not installed.
    """
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "1")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "10")  # s
    try:
        from mlflow.tracking import MlflowClient
    except ImportError as cause:
        raise MissingExtraError(
            "runtime.mlflow={address} needs the package 'mlflow-skinny', which is not installed. "
            "pip install 'racecraft[mlflow]'",
            address=address,
        ) from cause
    return MlflowClient


def metric_name(name: str) -> str:
    """Return a name with the letters that MLflow takes.

    >>> metric_name("Evaluation/progress %")
    'Evaluation/progress'
    """
    return re.sub(r"[^\w\-./: ]", "", name).strip()


def hidden(uri: str) -> str:
    """Return an address without its password.

    >>> hidden("https://me:secret@there/x")
    'https://…@there/x'
    """
    return re.sub(r"//[^/@]+@", "//…@", uri)


def first_line(cause: BaseException) -> str:
    """Return an error's kind and the beginning of what it says, in one line."""
    words = (str(cause).strip().splitlines() or [""])[0][:160]
    return f"{type(cause).__name__}: {hidden(words)}" if words else type(cause).__name__
