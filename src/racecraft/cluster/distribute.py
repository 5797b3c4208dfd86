"""A training whose worlds are carried by workers: the same experiment, with a gatherer. Begin with `distribute`."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from racecraft.algorithms.learner import Learner
from racecraft.algorithms.registry import ALGORITHMS
from racecraft.cluster.cluster_options import ClusterOptions, read_cluster
from racecraft.cluster.collector import ClusterCollector, Updates
from racecraft.cluster.messages import WorkerConfig
from racecraft.cluster.shares import parts_of, plan_of_share, shares_of
from racecraft.cluster.transport import Transport
from racecraft.cluster.worker_pool import COME_SECONDS, WorkerPool
from racecraft.contract.errors import SettingError
from racecraft.contract.world import WorldSpec
from racecraft.training.remote_collection import TickCallback
from racecraft.training.resume import MessageCallback
from racecraft.training.run_writer import TickRecorder
from racecraft.training.trainer import Distribute, Experiment


@dataclass
class ClusterGatherer:
    """Carries a learner through the worlds of a crew."""

    crew: WorkerPool
    spec: WorldSpec
    experiment: Experiment
    updates: Updates = field(default_factory=Updates)
    collecting: ClusterCollector | None = None

    @property
    def recorder(self) -> TickRecorder | None:
        """Hands over the ticks that workers kept."""
        return None if self.experiment.recorder is None else self.collecting

    def collector(self, learner: Learner, hears: TickCallback | None) -> ClusterCollector:
        """Return what collects for a learner."""
        experiment = self.experiment
        self.collecting = ClusterCollector(
            self.crew,
            self.spec,
            learner,
            self.updates,
            experiment.parts,
            experiment.algorithm.replay,
            hears,
        )
        return self.collecting


def distribute(cluster: str | int | None) -> Distribute | None:
    """Return what carries a training's worlds to the workers of a cluster; None where none is asked for.

    Args:
        cluster: As `--cluster` is given it: N, auto, HOST:PORT, N@auto, N@HOST:PORT.

    Raises:
        SettingError: It is none of these.

    What is returned raises, once it is asked to carry a training that can be spread:
        MissingExtraError: Ray is not installed.
        ClusterError: The cluster is not there, or this is inside `racecraft run`.
    """
    if cluster is None:
        return None
    options = read_cluster(str(cluster))

    def reach() -> Transport:
        # Not before the training is known to be one that can be spread: a wrong setting is told first.
        from racecraft.cluster.ray_transport import RayTransport

        return RayTransport(options)

    return spread_by(reach, options)


def spread_by(
    reach: Callable[[], Transport], options: ClusterOptions, come_seconds: float = COME_SECONDS
) -> Distribute:
    """Return what carries a training's worlds to workers.

    Args:
        reach: Makes a `Transport`, once it is known that the training can be spread.
        options: Which cluster, for what is said and for job.json.
        come_seconds: Workers are there by then, or do not come.
    """

    @contextlib.contextmanager
    def spread(kind: str, planned: Any, experiment: Experiment, on_message: MessageCallback) -> Iterator[Experiment]:
        _require_spreadable(experiment)
        on_message(f"- cluster {options}: waiting for its workers")
        with contextlib.closing(reach()) as transport:
            crew = _worker_pool(transport, kind, planned, come_seconds, on_message)
            gatherer = ClusterGatherer(crew, crew.open(), experiment)
            _print_workers(crew, options, on_message)

            def after_update(learner: Learner) -> None:
                gatherer.updates.add()
                experiment.after_update(learner)

            yield replace(
                experiment,
                gatherer=gatherer,
                after_update=after_update,
                job={**experiment.job, "cluster": _recorded(crew, options)},
            )
            _print_traffic(gatherer, on_message)

    return spread


def _worker_pool(
    transport: Transport, kind: str, planned: Any, come_seconds: float, on_message: MessageCallback
) -> WorkerPool:
    """Return workers in their places, not yet started."""
    shares = shares_of(parts_of(planned), transport.capacity, planned.seed)
    if len(shares) < transport.capacity:
        on_message(
            f"- cluster: {transport.capacity} workers, and rollout.num_worlds is {len(shares)}; so many of them work"
        )
    orders = [WorkerConfig(kind, plan_of_share(planned, share), share) for share in shares]
    return WorkerPool(transport, orders, on_message, come_seconds)


def _require_spreadable(experiment: Experiment) -> None:
    """Refuse what cannot be carried by workers.

    Raises:
        SettingError: The world or the algorithm cannot.
    """
    if experiment.stays:
        raise SettingError("--cluster: {stays} Leave --cluster out.", stays=experiment.stays)
    if experiment.algorithm.stays:
        raise SettingError(
            "--cluster: {name} {stays}. Use one of {others}, or leave --cluster out.",
            name=experiment.algorithm.name,
            others=", ".join(name for name, one in ALGORITHMS.items() if not one.stays),
            stays=experiment.algorithm.stays,
        )


def _recorded(crew: WorkerPool, asked: ClusterOptions) -> dict[str, Any]:
    """Return what job.json keeps of a cluster; `machines` counts the learner's, which may carry no worker."""
    machines = {socket.gethostname(), *(opened.host for opened in crew.opened)}
    return {"asked": str(asked), "workers": len(crew.opened), "machines": len(machines)}


def _print_workers(crew: WorkerPool, options: ClusterOptions, on_message: MessageCallback) -> None:
    hosts = {opened.host for opened in crew.opened}
    machines = "this machine" if options.address is None else f"{len(hosts)} machine{'s' * (len(hosts) > 1)}"
    on_message(f"- cluster {options}: {len(crew.opened)} workers on {machines}, the learner here")


def _print_traffic(gatherer: ClusterGatherer, on_message: MessageCallback) -> None:
    collecting = gatherer.collecting
    if collecting is None or not collecting.traffic.steps:
        return
    traffic = collecting.traffic
    came, went = traffic.bytes_in / traffic.steps, traffic.bytes_out / traffic.steps
    lost = f", {gatherer.crew.replaced} workers replaced" if gatherer.crew.replaced else ""
    on_message(f"cluster: {came:,.0f} bytes came and {went:,.0f} went for each of {traffic.steps:,} steps{lost}")
