"""`ray.tune`: experiments are trained one after the other, and nothing is searched for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from racecraft.compat.names.ray.tune import registry
from racecraft.compat.own_trainables import Trainable, learns_by_itself, report, train_own
from racecraft.compat.rllib_training import train_experiment
from racecraft.compat.rllib_words import EXPERIMENT_WORDS
from racecraft.contract.arguments import require_arguments
from racecraft.contract.errors import SettingError
from racecraft.training.trained import Trained

RUNNING_ARGUMENTS = (
    "search_alg", "scheduler", "server_port", "verbose", "progress_reporter", "resume", "queue_trials",
    "reuse_actors", "trial_executor", "raise_on_failed_trial", "concurrent", "with_server", "callbacks", "metric",
    "mode", "time_budget_s", "fail_fast", "log_to_file", "max_concurrent_trials", "loggers", "ray_auto_init",
    "run_errored_only", "global_checkpoint_period", "trial_name_creator", "trial_dirname_creator",
    "max_progress_failures", "chdir_to_trial_dir", "storage_path", "storage_filesystem", "checkpoint_config",
)  # fmt: skip
"""What any Tune from 0.5 to 2.x takes beside an experiment."""
SEARCHING = (
    "grid_search", "choice", "uniform", "loguniform", "quniform", "qloguniform", "randint", "qrandint", "lograndint",
    "randn", "sample_from", "Tuner", "TuneConfig",
)  # fmt: skip
"""Names by which Tune searches."""
UNFOLLOWED = ("search_alg", "scheduler", "resume", "time_budget_s", "callbacks")
"""Those that would change what is trained; said where one is given."""


class SearchedElsewhereError(SettingError, AttributeError):
    """A search is asked for where one experiment is trained."""


def run_experiments(experiments: Mapping[str, Mapping[str, Any]], **recorded: Any) -> None:
    """Train each experiment, one after the other.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    _say_unfollowed("run_experiments", recorded, RUNNING_ARGUMENTS)
    if not isinstance(experiments, Mapping) or not all(isinstance(one, Mapping) for one in experiments.values()):
        raise SettingError(
            f"run_experiments is given a {type(experiments).__name__}; expected {{name: {{'run', 'stop', 'config'}}}}."
        )
    for experiment in experiments.values():
        train_experiment(experiment)


def run(
    run_or_experiment: Any,
    name: str | None = None,
    stop: Mapping[str, Any] | None = None,
    config: Mapping[str, Any] | None = None,
    **recorded: Any,
) -> Trained | dict[str, Any]:
    """Train one experiment; return our own account of it, for there are no trials to analyse.

    What the script's own algorithm learned has the figures of its last iteration.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    _say_unfollowed("tune.run", recorded, (*RUNNING_ARGUMENTS, *EXPERIMENT_WORDS))
    words = {word: value for word, value in recorded.items() if word in EXPERIMENT_WORDS}
    kind = run_or_experiment
    if learns_by_itself(kind):
        return train_own(kind, {"stop": stop, "config": config, **words})
    algorithm = kind.__name__.removesuffix("Trainer") if isinstance(kind, type) else kind
    return train_experiment({**words, "run": algorithm, "stop": stop or {}, "config": config or {}})


def function(own: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function as it is; Tune before 0.8 wanted those of a configuration marked."""
    return own


def __getattr__(name: str) -> Any:
    if name in SEARCHING:
        raise SearchedElsewhereError(
            f"ray.tune.{name} searches, and a script trains one experiment here; `racecraft tune` searches, or "
            "HyperparameterTuner over an estimator's jobs."
        )
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name, obj=sys.modules[__name__])


def _say_unfollowed(function: str, given: Mapping[str, Any], known: tuple[str, ...]) -> None:
    require_arguments(function, given, known)
    for word in UNFOLLOWED:
        if given.get(word):
            print(f"- {function}: {word} is not followed here; `racecraft tune` searches and prunes")


register_env, register_trainable = registry.register_env, registry.register_trainable

__all__ = [
    "Trainable", "function", "register_env", "register_trainable", "registry", "report", "run", "run_experiments",
]  # fmt: skip
