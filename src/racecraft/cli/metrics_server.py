"""`--metrics-port` beside a training, whatever is trained."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback

MetricsPort = Annotated[
    int | None,
    typer.Option("--metrics-port", help="Serve Prometheus metrics on this port of this machine; 0: a free one."),
]


def measured(
    shown: TrainingCallback, port: int | None, model: str | None, tell: Callable[[str], None], detached: bool = False
) -> TrainingCallback:
    """Return who watches, with the metrics served beside where a port was asked for.

    Args:
        shown: Who watches anyway.
        port: What --metrics-port said.
        model: What the label `model` says; None: nothing better is known.
        tell: Says a line to a person.
        detached: Whether the training leaves the terminal.

    Raises:
        LiveMetricsError: The port is none, or is taken.
        SettingError: The training leaves the terminal, and the port with it.
    """
    if port is None:
        return shown
    if detached:
        raise SettingError(
            "--metrics-port serves a training of this terminal, and --detach lets it go; expected one of them."
        )
    from racecraft.training.callbacks import Callbacks
    from racecraft.training.live_metrics import LiveMetrics

    live = LiveMetrics(port, model or "racecraft")
    tell(f"metrics: {live.address}")
    return Callbacks(shown, live)
