"""The one door to Ray: workers as its actors, on a cluster of this machine or of many. Begin with `RayTransport`.

Between the processes of one cluster Ray pickles what passes; nothing of it is ever written to a file.
"""

from __future__ import annotations

import contextlib
import logging
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator
from types import ModuleType
from typing import Any

from racecraft.cluster.cluster_options import AUTO, ClusterOptions
from racecraft.cluster.deadlines import load_scaled
from racecraft.cluster.messages import WorkerEnv
from racecraft.cluster.transport import ClusterError, WorkerLostError
from racecraft.contract.errors import MissingExtraError

STORE_BYTES = 2**30
"""Shared memory of a cluster made here, for what passes between its processes."""
PROBE_SECONDS = 30.0
"""A cluster that does not answer by then does not stand; longer on a machine with much else to do."""
TOKEN = "RAY_AUTH_TOKEN"
"""Stands in whatever Ray says of a token that is missing or wrong (Ray 2.52 and later)."""
SHORT_PLACE = "/tmp"
"""Where a cluster's sockets lie: their whole path may have 107 letters."""


class RayTransport:
    """Reaches workers through Ray Core.

    Args:
        asked: Which cluster.

    Raises:
        MissingExtraError: Ray is not installed.
        ClusterError: The cluster is not there.
    """

    def __init__(self, options: ClusterOptions) -> None:
        self._ray = ray = imported_ray()
        self._asked, self._doors = options, contextlib.ExitStack()
        self._workers: list[Any] = []
        with _closed_on_failure(self._doors):
            if options.address is None:
                self._make(options.workers or 1)
            else:
                self._join(options.address)
        from racecraft.cluster.worker import Worker

        self._worker = ray.remote(max_restarts=0, max_task_retries=0, scheduling_strategy="SPREAD")(Worker)
        here = WorkerEnv(tuple(place or os.getcwd() for place in sys.path), os.getcwd())
        self._surroundings = ray.put(here)

    @property
    def capacity(self) -> int:
        """How many workers were requested, or else one a core, one core left for the learner."""
        if self._asked.workers is not None:
            return self._asked.workers
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)) - 1)

    def start(self) -> Any:
        """Start a worker on a free core; a successor shares one where none is free."""
        taken = (
            1.0 if len(self._workers) < self.capacity or self._ray.available_resources().get("CPU", 0.0) >= 1 else 0.0
        )
        worker = self._worker.options(num_cpus=taken).remote(self._surroundings)
        self._workers.append(worker)
        return worker

    def ask(self, worker: Any, what: str, message: Any) -> Any:
        """Ask a worker."""
        return getattr(worker, what).remote(message)

    def for_all(self, message: Any) -> Any:
        """Put a message where every process of a machine reads it."""
        return self._ray.put(message)

    def answered(self, tickets: Collection[Any], seconds: float) -> list[Any]:
        """Wait until a question is answered or lost; return all that are."""
        waiting = list(tickets)
        done, _ = self._ray.wait(waiting, num_returns=1, timeout=seconds)
        if done:
            done, _ = self._ray.wait(waiting, num_returns=len(waiting), timeout=0)
        return list(done)

    def answer(self, ticket: Any) -> Any:
        """Return an answer that is there."""
        errors = self._ray.exceptions
        try:
            return self._ray.get(ticket)
        except (errors.RayActorError, errors.ObjectLostError, errors.OutOfMemoryError) as lost:
            raise WorkerLostError(_first_line(lost)) from lost

    def end(self, worker: Any) -> None:
        """End a worker's process."""
        self._ray.kill(worker)

    def close(self) -> None:
        """End all workers; a cluster made here ends, too."""
        self._doors.close()

    def _make(self, workers: int) -> None:
        """Make a cluster of this machine, for this training only; nobody else finds it."""
        folder = tempfile.mkdtemp(prefix="racecraft-", dir=SHORT_PLACE if os.path.isdir(SHORT_PLACE) else None)
        self._doors.callback(shutil.rmtree, folder, ignore_errors=True)
        self._doors.callback(self._shut_down)
        self._begin(
            lambda ray: ray.init(
                address="local",
                num_cpus=workers,
                num_gpus=0,
                object_store_memory=STORE_BYTES,
                include_dashboard=False,
                log_to_driver=False,
                configure_logging=False,
                logging_level=logging.ERROR,
                _temp_dir=folder,
            )
        )

    def _join(self, address: str) -> None:
        """Become part of a cluster that stands."""
        trouble = _trouble(address)
        if TOKEN in trouble:
            raise ClusterError(
                "--cluster {asked}: Ray's token is missing or is not the cluster's; expected RAY_AUTH_MODE=token and "
                "the cluster's token in RAY_AUTH_TOKEN or in the file that RAY_AUTH_TOKEN_PATH names.",
                asked=self._asked,
            )
        if trouble and address != AUTO:
            raise ClusterError(
                "--cluster {asked}: no Ray cluster answers at {address}; expected one that was begun with `ray "
                "start --head --port=PORT` on that machine, and that this one can reach.",
                asked=self._asked,
                address=address,
            )
        self._doors.callback(self._shut_down)
        self._begin(
            lambda ray: ray.init(
                address=address, log_to_driver=False, configure_logging=False, logging_level=logging.ERROR
            )
        )

    def _begin(self, init: Callable[[ModuleType], Any]) -> None:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        try:
            init(self._ray)
        except (ConnectionError, RuntimeError, ValueError, OSError) as error:
            raise ClusterError(
                "--cluster {asked}: Ray does not begin ({first_line}); expected a cluster that this "
                "machine is part of: `ray start --head` makes one, `ray start --address=HOST:PORT` joins one.",
                asked=self._asked,
                first_line=_first_line(error),
            ) from error

    def _shut_down(self) -> None:
        for worker in self._workers:
            with contextlib.suppress(Exception):  # some are gone by themselves
                self._ray.kill(worker)
        self._ray.shutdown()


def imported_ray() -> ModuleType:
    """Return Ray.

    Raises:
        MissingExtraError: It is not installed.
        ClusterError: Inside `racecraft run`, where its name is lent to old scripts.
    """
    try:
        import ray
    except ImportError as cause:
        raise MissingExtraError(
            "--cluster needs the package 'ray', which is not installed. pip install 'racecraft[cluster]'"
        ) from cause
    if not hasattr(ray, "remote"):
        raise ClusterError(
            "Inside `racecraft run` the name ray stands for what old scripts use of it, here and in every process that "
            "is begun; expected a training outside. Use `racecraft … train --cluster` or `racecraft.train(cluster=…)` "
            "in a script that plain python runs."
        )
    module: ModuleType = ray
    return module


def _trouble(address: str) -> str:
    """Return what Ray's own check says against the cluster at an address; "": it answers."""
    where = [] if address == AUTO else [f"--address={address}"]
    probe = [sys.executable, "-m", "ray.scripts.scripts", "health-check", *where]
    seconds = load_scaled(PROBE_SECONDS)
    try:
        done = subprocess.run(probe, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return f"no answer within {seconds:g} s"
    return "" if done.returncode == 0 else f"{done.stderr}\nexit code {done.returncode}"


@contextlib.contextmanager
def _closed_on_failure(doors: contextlib.ExitStack) -> Iterator[None]:
    try:
        yield
    except BaseException:
        doors.close()
        raise


def _first_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0].rstrip(".") if lines else type(error).__name__
