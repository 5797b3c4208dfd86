"""Metrics for Prometheus beside a training, whatever is trained."""

from __future__ import annotations

from collections.abc import Callable

from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import Callbacks, TrainingCallback


def with_metrics(
    callback: TrainingCallback, options: TrainingOptions, progress: Callable[[str], None]
) -> TrainingCallback:
    """Return the callback of a training, with its metrics served beside where the options name a port.

    Raises:
        PortError: The address cannot be listened on.
    """
    if options.metrics_port is None:
        return callback
    from racecraft.serving.metrics_server import MetricsServer
    from racecraft.training.live_metrics import LiveMetrics

    live = LiveMetrics((options.model if options.run is None else options.run.name) or "racecraft")
    progress(f"metrics: {MetricsServer(live.registry, options.metrics_host, options.metrics_port).address}")
    return Callbacks(callback, live)


def refuse_metrics(options: TrainingOptions) -> None:
    """Refuse metrics of a training that leaves this process.

    Raises:
        SettingError: A port is named.
    """
    if options.metrics_port is not None:
        raise SettingError(
            "--metrics-port serves a training of this terminal, and --detach lets it go; expected one of them."
        )
