"""Train, and go on with a run, from Python."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from racecraft.actions.train_run import TrainedRun
from racecraft.actions.training_options import TrainingOptions
from racecraft.cluster.distribute import distribute
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import find_kind
from racecraft.contract.progress import Progress
from racecraft.settings.describe import value_text
from racecraft.settings.request import make_request
from racecraft.training import worlds
from racecraft.training.callbacks import NullCallback, TrainingCallback
from racecraft.training.trained import Trained


def train(
    kind: str,
    *,
    settings: Mapping[str, Any] | Iterable[str] = (),
    stops: str | Iterable[str] = (),
    callback: TrainingCallback | None = None,
    quiet: bool = False,
    pictures: bool = False,
    **options: Any,
) -> TrainedRun:
    """Train in any kind of world until a stop condition holds.

    Args:
        kind: Name of an installed world: "deepracer", "battlesnake", "gymnasium", "unity" or another.
        settings: {"ppo.learning_rate": 1e-4} or ["ppo.learning_rate=1e-4"], as after `--set`.
        stops: "minutes=5", or several; none: the world's own.
        callback: Watches; None: a line an iteration on standard error, or nothing where `quiet`.
        quiet: Say nothing.
        pictures: Leave the pictures and the report in the run folder that the command leaves.
        options: The options and arguments of the command of that kind by their names: `run`, `seed`, `algorithm`,
            `from_`, `resume`, `mirror` …; `folder`, `track`, `group` …; `environment`; `size`; `build`, `config` ….

    Returns:
        Where the run lies and what it came to; of `seeds` their runs, of `detach` the job, as the command's `--json`.

    Raises:
        UserInputError: Something given cannot be used.
    """
    for found, expected in (("stop", "stops"), ("set_", "settings"), ("set", "settings")):
        if found in options:
            raise SettingError("train has no '{found}'; expected {expected}=….", found=found, expected=expected)
    action = find_kind(kind).piece("train")
    if action is None:
        raise SettingError("{kind} brings no action that trains; expected `train` in its WorldKind.", kind=kind)
    request: TrainingOptions = make_request(
        action.request, stop=_texts(stops), set_=_overrides(settings), pictures=pictures, **options
    )
    trained: TrainedRun = action(request, progress=_Lines(quiet, callback))
    return trained


def resume(
    run: str | Path,
    *,
    stops: str | Iterable[str] = (),
    callback: TrainingCallback | None = None,
    quiet: bool = False,
    cluster: str | int | None = None,
) -> Trained:
    """Go on with a run of any kind from its last whole iteration, as if it had never stopped.

    Args:
        run: The run folder.
        stops: New stop conditions; none: those it was begun with.
        callback: Watches, as in `train`.
        quiet: Say nothing.
        cluster: Who carries the worlds from now on, as in `train`; whoever did until now.

    Raises:
        RunFolderError: No run folder, or it is being trained.
    """
    progress = _Lines(quiet, callback)
    return worlds.resume(run, _texts(stops), progress.training_callback(), progress, spread=distribute(cluster))


def _texts(stops: str | Iterable[str]) -> tuple[str, ...]:
    return (stops,) if isinstance(stops, str) else tuple(stops)


def _overrides(settings: Mapping[str, Any] | Iterable[str]) -> tuple[str, ...]:
    if isinstance(settings, Mapping):
        return tuple(f"{name}={value_text(_tuple(value))}" for name, value in settings.items())
    return tuple(settings)


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


class _Lines(Progress):
    """Prints on standard error, or nothing where `quiet`."""

    def __init__(self, quiet: bool, callback: TrainingCallback | None = None) -> None:
        self._quiet, self._callback = quiet, callback

    def __call__(self, message: str) -> None:
        if not self._quiet:
            print(message, file=sys.stderr)

    @property
    def child_output(self) -> int | None:
        return super().child_output if self._quiet else sys.stderr.fileno()

    def training_callback(self) -> TrainingCallback:
        """Return the callback that was given, else a line an iteration on standard error."""
        from racecraft.training.progress import LineWatcher

        return self._callback or (NullCallback() if self._quiet else LineWatcher(sys.stderr))
