"""Look for settings from Python: a search of trials, or a population."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.formats.atomic import make_folder
from racecraft.formats.population import PopulationRecord
from racecraft.formats.tuning import TuningRecord
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.tuning.dry_run import require_understood
from racecraft.jobs.tuning.population import check_population, train
from racecraft.jobs.tuning.population_trials import PopulationTrials, check_round
from racecraft.jobs.tuning.search import search
from racecraft.jobs.tuning.space import read_parameter
from racecraft.jobs.tuning.study import Study
from racecraft.jobs.tuning.training_trials import Objective, TrainingTrials, check_command


def tune(
    command: str | Sequence[str],
    parameters: Mapping[str, str],
    folder: str | Path,
    *,
    sampler: str = "tpe",
    trials: int = 20,
    pruner: str = "median",
    objective: str = "evaluation_score",
    maximise: bool = True,
    parallel: int | None = None,
    seed: int = 0,
    quiet: bool = False,
) -> TuningRecord:
    """Train many times with other settings each; a search that lies in the folder is gone on with.

    Args:
        command: A training command, what stands behind `racecraft`, with --stop, such as "gym train CartPole-v1 --stop
            minutes=1".
        parameters: {"ppo.learning_rate": "1e-4..1e-2:log", "ppo.epochs": "2..8", "network.activation": "relu,tanh"}.
        folder: Of the search.
        sampler: "tpe", "random" or "grid".
        trials: How many in all.
        pruner: "median", "hyperband" or "none".
        objective: A column of metrics.jsonl, or a regular expression over the log.
        maximise: Whether more is better.
        parallel: How many at a time; None: one for every two cores.
        seed: Of the sampler.
        quiet: Say nothing.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
        MissingExtraError: Optuna is not installed.
    """
    folder, words = Path(folder), check_command(_words(command))
    known = _parameters(parameters)
    aim = Objective(objective, maximise)
    require_understood(words, known)
    make_folder(folder)
    study = Study(folder, known, maximise, sampler, pruner, seed)
    at_a_time, cores = _share(parallel)
    launch = TrainingTrials(folder, words, aim, cores, JobPaths.of_user())
    search(study, launch, trials, at_a_time, lambda one: _say(quiet, f"trial {one.number}: {one.state} {one.score}"))
    return TuningRecord(words, objective, maximise, False, study.trials(), study.importances())


def train_population(
    command: str | Sequence[str],
    parameters: Mapping[str, str],
    folder: str | Path,
    *,
    population: int = 4,
    rounds: int = 5,
    objective: str = "evaluation_score",
    maximise: bool = True,
    parallel: int | None = None,
    seed: int = 0,
    quiet: bool = False,
) -> PopulationRecord:
    """Train a population in rounds; bad members take over weights and settings of good ones.

    A population that lies in the folder is gone on with. Arguments as for `tune`, and:

    Args:
        command: A training command; its --stop minutes, steps or iterations say how long a round is.
        parameters: What may change in the middle of a training; nothing of the network.
        folder: Of the population; its runs lie in `trials`.
        population: Members.
        rounds: Rounds that each of them trains.
        objective: See `tune`; the last figure of a round counts.
        maximise: See `tune`.
        parallel: See `tune`.
        seed: Of what is drawn.
        quiet: Say nothing.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
    """
    folder, words = Path(folder), check_command(_words(command))
    known = _parameters(parameters)
    check_population(population, rounds)
    check_round(words, known)
    aim = Objective(objective, maximise, take_last=True)
    require_understood(words, known)
    make_folder(folder)
    at_a_time, cores = _share(parallel)
    launch = PopulationTrials(folder, words, aim, cores, JobPaths.of_user())
    record = PopulationRecord(words, objective, maximise, dict(parameters), population, rounds, seed)
    return train(
        folder, record, known, launch, at_a_time,
        lambda one: _say(quiet, f"round {one.round}, member {one.member}: {one.score}"),
    )  # fmt: skip


def _words(command: str | Sequence[str]) -> list[str]:
    words = shlex.split(command) if isinstance(command, str) else list(command)
    if not words:
        raise SettingError("the command is empty; expected one such as 'gym train CartPole-v1 --stop minutes=1'.")
    return words


def _parameters(parameters: Mapping[str, str]) -> dict[str, Any]:
    if not parameters:
        raise SettingError("no parameter is varied; expected some, such as {'ppo.learning_rate': '1e-4..1e-2:log'}.")
    return dict(read_parameter(f"{name}={told}") for name, told in parameters.items())


def _share(parallel: int | None) -> tuple[int, int]:
    """Return how many train at a time, and the cores of each."""
    cores = Capacity.of_machine().cores
    at_a_time = parallel or max(1, cores // 2)
    return at_a_time, max(1, cores // at_a_time)


def _say(quiet: bool, text: str) -> None:
    if not quiet:
        print(text, file=sys.stderr)
