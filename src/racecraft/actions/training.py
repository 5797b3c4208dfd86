"""Train, and go on with a run, from Python."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from racecraft.actions.report import leave_report
from racecraft.cluster.distribute import distribute
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import find_kind
from racecraft.settings.describe import value_text
from racecraft.training import worlds
from racecraft.training.callbacks import NullCallback, TrainingCallback
from racecraft.training.trainer import Trained


def train(
    kind: str,
    *,
    settings: Mapping[str, Any] | Iterable[str] = (),
    stops: str | Iterable[str] = (),
    callback: TrainingCallback | None = None,
    quiet: bool = False,
    cluster: str | int | None = None,
    pictures: bool = False,
    **asked: Any,
) -> Trained:
    """Train in any kind of world until a stop condition holds.

    Args:
        kind: Name of an installed world: "deepracer", "battlesnake", "gymnasium", "unity" or another.
        settings: {"ppo.learning_rate": 1e-4} or ["ppo.learning_rate=1e-4"], as after `--set`.
        stops: "minutes=5", or several; none: the world's own.
        callback: Watches; None: a line an iteration on standard error, or nothing where `quiet`.
        quiet: Say nothing.
        cluster: Who carries the worlds, as after `--cluster`: 4 processes here, "auto" or "HOST:PORT" those of a Ray
            cluster; None: this process.
        pictures: Leave the pictures and the report in the run folder that the command leaves.
        asked: What the command of that kind is asked: `algorithm`, `run`, `seed`, `clone_from`, and the world's own
            words (`folder`, `track`, `tracks`, `groups`, `hold_out`, `preset` …; `environment`; `game`; `build`,
            `config` …).

    Returns:
        Where the run lies and what it came to.

    Raises:
        UserInputError: Something that was asked for cannot be used.
    """
    request_class = worlds.training_in(kind).Request
    known = {field.name for field in dataclasses.fields(request_class)}
    for name in asked:
        if name not in known:
            raise SettingError(
                "train({kind!r}) knows no '{name}'. {hint}", kind=kind, name=name, hint=nearest(name, sorted(known))
            )
    words = dict(asked)
    for name in ("run", "folder", "config"):
        if words.get(name) is not None and name in known:
            words[name] = Path(words[name])
    for name in ("tracks", "groups", "hold_out"):
        if name in words:
            words[name] = (words[name],) if isinstance(words[name], str | Mapping) else tuple(words[name])
    request = request_class(stops=_texts(stops), overrides=_overrides(settings), **words)
    trained = worlds.train(request, callback or _callback(quiet), _say(quiet), distribute(cluster))
    leave_pictures(trained, pictures, _say(quiet))
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
    return worlds.resume(run, _texts(stops), callback or _callback(quiet), _say(quiet), spread=distribute(cluster))


def leave_pictures(trained: Trained, pictures: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """Leave pictures and pages in the run folder of a training; return their paths, and figures of their own, by kind.

    Args:
        trained: The training.
        pictures: Whether they are wanted; what a world judges after a training is judged anyway.
        progress: Receives messages.
    """
    own = find_kind(trained.kind).piece("pictures")
    if own is not None:
        left: dict[str, Any] = own(trained, pictures, progress)
        return left
    return dict(leave_report(trained.run.path, progress)) if pictures else {}


def _texts(stops: str | Iterable[str]) -> tuple[str, ...]:
    return (stops,) if isinstance(stops, str) else tuple(stops)


def _overrides(settings: Mapping[str, Any] | Iterable[str]) -> tuple[str, ...]:
    if isinstance(settings, Mapping):
        return tuple(f"{name}={value_text(_tuple(value))}" for name, value in settings.items())
    return tuple(settings)


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _callback(quiet: bool) -> TrainingCallback:
    if quiet:
        return NullCallback()
    from racecraft.training.progress import LineWatcher

    return LineWatcher(sys.stderr)


def _say(quiet: bool) -> Any:
    return (lambda text: None) if quiet else (lambda text: print(text, file=sys.stderr))
