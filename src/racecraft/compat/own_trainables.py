"""Algorithms of a script's own, in the shapes that Ray's Tune takes. Begin with `train_own`.

A class derives from `Trainable`: `setup` begins, `step` learns for one iteration and returns its figures,
`save_checkpoint` writes what was learned. A function learns by itself and reports an iteration by `reporter(…)` or
`tune.report(…)`. What it learns is the script's own: it is told and stopped here, and never judged or exported.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from racecraft.compat.rllib_results import lines
from racecraft.compat.rllib_words import LATER_STOPS
from racecraft.contract.errors import SettingError

_registered: dict[str, Any] = {}
_reporting: list[Callable[[Mapping[str, Any]], None]] = []


class StopConditionMetError(Exception):
    """A function that learns by itself has met a stop."""


class Trainable:
    """What a script's own algorithm derives from.

    Args:
        config: The experiment's, with its environment under `env`.
    """

    def __init__(self, config: Mapping[str, Any] | None = None, logger_creator: Any = None) -> None:
        self.config, self.iteration = dict(config or {}), 0
        self.logdir = os.environ.get("SM_MODEL_DIR", ".")
        _first(self, "setup", "_setup")(self.config)

    def train(self) -> dict[str, Any]:
        """Learn for one iteration; return its figures."""
        result = _first(self, "step", "_train")()
        self.iteration += 1
        if not isinstance(result, Mapping):
            raise SettingError(
                "{name}.step returns {found!r}; expected its figures, {{'episode_reward_mean': …}}.",
                name=type(self).__name__,
                found=result,
            )
        return dict(result)

    def setup(self, config: dict[str, Any]) -> None:
        """Begin; a script's own."""

    def stop(self) -> None:
        """Let go of what `setup` took."""
        _first(self, "cleanup", "_stop")()

    def cleanup(self) -> None:
        """Let go of it; a script's own."""


def register_trainable(name: str, trainable: Any) -> None:
    """Keep an algorithm of a script's own under the name that an experiment's `run` asks for.

    Raises:
        SettingError: It is no class that has `step` (`_train` before Ray 0.9), and no function.
    """
    if not learns_by_itself(trainable):
        raise SettingError(
            "register_trainable: '{name}' is {trainable!r}; expected a class derived from ray.tune.Trainable with a "
            "method step, or a function of a configuration and a reporter.",
            name=name,
            trainable=trainable,
        )
    _registered[name] = trainable


def learns_by_itself(trainable: Any) -> bool:
    """Tell whether something learns by itself: a class with `step`, or a function."""
    if isinstance(trainable, type):
        return issubclass(trainable, Trainable) and any(hasattr(trainable, name) for name in ("step", "_train"))
    return callable(trainable)


def registered(name: Any) -> Any | None:
    """Return what a script registered under a name; None: nothing."""
    return _registered.get(name) if isinstance(name, str) else None


def report(_metrics: Mapping[str, Any] | None = None, **figures: Any) -> None:
    """Take in an iteration of a function that learns by itself."""
    if _reporting:
        _reporting[-1]({**(_metrics or {}), **figures})


def train_own(trainable: Any, experiment: Mapping[str, Any]) -> dict[str, Any]:
    """Train until a stop of the experiment's is met, or it says `done`; print each iteration; return the last one."""
    config = {"env": experiment.get("env"), **(experiment.get("config") or {})}
    report = _Report({LATER_STOPS.get(name, name): amount for name, amount in (experiment.get("stop") or {}).items()})
    if not isinstance(trainable, type):
        _run_function(trainable, config, report)
        return report.result
    learner = trainable(config)
    try:
        while not report.record(learner.train()):
            pass
        _save(learner)
    finally:
        learner.stop()
    return report.result


class _Report:
    """Iterations as they are reported, and whether a stop is met."""

    def __init__(self, stops: Mapping[str, Any]) -> None:
        self._stops, self._begun = stops, time.monotonic()
        self.result: dict[str, Any] = {"training_iteration": 0, "timesteps_total": 0, "episodes_total": 0}

    def record(self, figures: Mapping[str, Any]) -> bool:
        """Print an iteration; tell whether it was the last."""
        before = self.result
        counts = {
            f"{name}_total": before[f"{name}_total"] + (figures.get(f"{name}_this_iter") or 0)
            for name in ("timesteps", "episodes")
        }
        self.result = {
            **counts,
            **figures,
            "training_iteration": before["training_iteration"] + 1,
            "time_total_s": round(time.monotonic() - self._begun, 3),
        }
        print("".join(f"  {line}\n" for line in lines(self.result)), end="", flush=True)
        met = any(name in self.result and self.result[name] >= amount for name, amount in self._stops.items())
        return met or bool(figures.get("done"))


def _run_function(function: Callable[..., Any], config: dict[str, Any], report: _Report) -> None:
    def reporter(_metrics: Mapping[str, Any] | None = None, **figures: Any) -> None:
        if report.record({**(_metrics or {}), **figures}):
            raise StopConditionMetError

    takes_reporter = function.__code__.co_argcount > 1 if hasattr(function, "__code__") else True
    _reporting.append(reporter)
    try:
        function(config, reporter) if takes_reporter else function(config)
    except StopConditionMetError:
        pass
    finally:
        _reporting.pop()


def _save(learner: Trainable) -> None:
    """Let it write what it learned into the job's model."""
    folder, save = os.environ.get("SM_MODEL_DIR"), getattr(learner, "save_checkpoint", getattr(learner, "_save", None))
    if folder and save is not None:
        place = Path(folder) / f"checkpoint_{learner.iteration}"
        place.mkdir(parents=True, exist_ok=True)
        save(str(place))


def _first(learner: Trainable, later: str, before: str) -> Callable[..., Any]:
    """Return a method by what Ray calls it now, or by what it called it before 0.9 where a script has that one."""
    found: Callable[..., Any] = getattr(learner, before, None) or getattr(learner, later)
    return found
