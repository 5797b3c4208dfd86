"""`--metrics-port` beside a training, whatever is trained."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback

HIGHEST_PORT = 65535


def measured(
    shown: TrainingCallback,
    port: int | None,
    host: str,
    model: str | None,
    tell: Callable[[str], None],
    detached: bool = False,
) -> TrainingCallback:
    """Return who watches, with the metrics served beside where a port was asked for.

    Args:
        shown: Who watches anyway.
        port: What --metrics-port said.
        host: What --metrics-host said.
        model: What the label `model` says; None: nothing better is known.
        tell: Says a line to a person.
        detached: Whether the training leaves the terminal.

    Raises:
        PortError: The address cannot be listened on.
        SettingError: The port is none; or the training leaves the terminal, and the port with it.
    """
    if port is None:
        return shown
    if detached:
        raise SettingError(
            "--metrics-port serves a training of this terminal, and --detach lets it go; expected one of them."
        )
    if not 0 <= port <= HIGHEST_PORT:
        raise SettingError(
            "--metrics-port is {port}; expected 0 to {highest_port}.", port=port, highest_port=HIGHEST_PORT
        )
    from racecraft.serving.metrics_server import MetricsServer
    from racecraft.training.callbacks import Callbacks
    from racecraft.training.live_metrics import LiveMetrics

    live = LiveMetrics(model or "racecraft")
    tell(f"metrics: {MetricsServer(live.registry, host, port).address}")
    return Callbacks(shown, live)
