"""Look for the settings that train best: a search of trials, or a population. Begin with `search_settings`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.population import NOT_OF_POPULATIONS, PBT, TrainedPopulation, train_members
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option

if TYPE_CHECKING:
    from racecraft.formats.population import PopulationRecord
    from racecraft.formats.tuning import TrialRecord, TuningRecord
    from racecraft.jobs.tuning.space import Parameter
    from racecraft.jobs.tuning.study import Study
    from racecraft.jobs.tuning.training_trials import Objective

PAGE = "tuning.html"


@dataclass(frozen=True, kw_only=True)
class BudgetOptions(Request):
    """How much is tried."""

    trials: int = option(20, "How many in all, those of --from beside them.", low=1)
    parallel: int | None = option(
        None, "How many at a time; by default one for every two cores, and no less than one.", low=1
    )

    def at_a_time(self, cores: int) -> int:
        """Return how many trials run side by side."""
        return self.parallel or max(1, cores // 2)


@dataclass(frozen=True, kw_only=True)
class ObjectiveOptions(Request):
    """What counts."""

    objective: str = option(
        "evaluation_score",
        "A column of metrics.jsonl, or a regular expression over the log, such as 'reward=([0-9.]+)'.",
    )
    minimize: bool = option(False, "Less is better.")
    last: bool = option(False, "The last figure counts and not the best; nothing is given up early.")

    def of_trials(self) -> Objective:
        """Return it as trials are judged by it."""
        from racecraft.jobs.tuning.training_trials import Objective

        return Objective(self.objective, not self.minimize, self.last)


@dataclass(frozen=True, kw_only=True)
class SamplerOptions(Request):
    """Who says what is tried next, and what is given up."""

    sampler: str = option(
        "tpe",
        "Who says what is tried next: tpe, random or grid; or pbt, a population that trains in rounds, in "
        "which bad members take over weights and settings of good ones.",
    )
    population: int = option(4, "Members of the population (pbt).")
    rounds: int = option(5, "Rounds that it trains, each to the command's --stop (pbt).")
    pruner: str | None = option(None, "Who gives trials up early: median (where nobody says), hyperband or none.")
    seed: int = option(0, "Of the sampler.", low=0)

    def gives_up(self, aim: ObjectiveOptions) -> str:
        """Return who gives trials up early.

        Raises:
            SettingError: Somebody shall, and --last lets nobody.
        """
        from racecraft.contract.errors import SettingError

        if aim.last and self.pruner not in (None, "none"):
            raise SettingError(
                "--last gives nothing up early, and --pruner {pruner} would; expected one of them.", pruner=self.pruner
            )
        return self.pruner or ("none" if aim.last else "median")


@dataclass(frozen=True, kw_only=True)
class FolderOptions(Request):
    """Where the search lies, and what it begins with."""

    run: Path | None = option(None, "Folder of the search; one that is there is gone on with. By default tunings/N.")
    from_: Path | None = option(None, "Folder of an earlier search, whose trials this one begins with.")

    def folder(self) -> Path:
        """Return the folder of the search."""
        return self.run or _next_folder(Path("tunings"))


@dataclass(frozen=True, kw_only=True)
class TuneRequest(Request):
    """What is trained, what is varied, and how the search goes on."""

    words: tuple[str, ...] = argument(
        "A training command, the words behind `racecraft`; with --stop.", metavar="COMMAND…"
    )
    param: tuple[str, ...] = option(
        MISSING, "What is varied: NAME=LOW..HIGH, with :log behind it for a logarithmic scale, or NAME=ONE,OTHER."
    )
    extent: BudgetOptions = group(BudgetOptions)
    aim: ObjectiveOptions = group(ObjectiveOptions)
    choice: SamplerOptions = group(SamplerOptions)
    place: FolderOptions = group(FolderOptions)


@dataclass(frozen=True)
class TunedSettings:
    """A search as far as it went."""

    folder: Path
    study: Study
    record: TuningRecord

    def as_dictionary(self) -> dict[str, Any]:
        """Return folder, page and the best trial."""
        best, trials = self.study.best(), self.study.trials()
        figures: dict[str, Any] = {"tuning": self.folder, "trials": len(trials), "page": self.folder / PAGE}
        figures["best"] = (
            None if best is None else {"number": best.number, "score": best.score, "values": dict(best.values)}
        )
        return figures


@action
def search_settings(request: TuneRequest, progress: Progress = quiet) -> TunedSettings | TrainedPopulation:
    """Train many times with other settings each, and find those that do best.

    Every trial is a job; its run lies in the search's folder. Ctrl-C ends the search, and the same command with --run
    goes on with it.

    Examples:

        racecraft tune --param ppo.learning_rate=1e-4..1e-2:log gym train CartPole-v1 --stop minutes=0.5

        racecraft tune --objective seconds --minimize --last --param ppo.epochs=2..6 train --stop laps --stop minutes=1

        racecraft tune --run tunings/1 --trials 40 --param network.activation=relu,tanh train my-car --stop minutes=1

        racecraft tune --sampler pbt --param ppo.learning_rate=1e-4..1e-2:log snakes train --stop minutes=2

    Raises:
        UserInputError: Something given cannot be used.
        MissingExtraError: Optuna is not installed.
    """
    from racecraft.formats.population import PopulationRecord
    from racecraft.jobs.tuning.space import read_parameter
    from racecraft.jobs.tuning.training_trials import check_command

    command = check_command(request.words)
    parameters = dict(read_parameter(one) for one in request.param)
    if len(parameters) < len(request.param):
        raise SettingError("a --param is given twice; expected every name once.")
    aim, choice = request.aim, request.choice
    if choice.sampler == PBT:
        _refuse_given(request, NOT_OF_POPULATIONS, f"--sampler {PBT} has a population and rounds")
        varied = dict(one.split("=", 1) for one in request.param)
        record = PopulationRecord(
            command, aim.objective, not aim.minimize, varied, choice.population, choice.rounds, choice.seed
        )
        return train_members(record, parameters, request.place.folder(), request.extent.parallel, progress)
    _refuse_given(request, ("--population", "--rounds"), f"only --sampler {PBT} has a population")
    return _search(command, parameters, request, progress)


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
        quiet: Report nothing.

    Raises:
        UserInputError: Something given cannot be used.
        MissingExtraError: Optuna is not installed.
    """
    found = search_settings(
        words=_words(command), run=folder, sampler=sampler, trials=trials, pruner=pruner, objective=objective,
        minimize=not maximise, parallel=parallel, seed=seed, progress=_report(quiet), param=_varied(parameters),
    )  # fmt: skip
    assert isinstance(found, TunedSettings)
    return found.record


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
        seed: Of the random choices.
        quiet: Report nothing.

    Raises:
        UserInputError: Something given cannot be used.
    """
    found = search_settings(
        words=_words(command), run=folder, sampler=PBT, population=population, rounds=rounds,
        objective=objective, minimize=not maximise, parallel=parallel, seed=seed, progress=_report(quiet),
        param=_varied(parameters),
    )  # fmt: skip
    assert isinstance(found, TrainedPopulation)
    return found.record


def _words(command: str | Sequence[str]) -> list[str]:
    words = shlex.split(command) if isinstance(command, str) else list(command)
    if not words:
        raise SettingError("the command is empty; expected one such as 'gym train CartPole-v1 --stop minutes=1'.")
    return words


def _varied(parameters: Mapping[str, str]) -> list[str]:
    if not parameters:
        raise SettingError("no parameter is varied; expected some, such as {'ppo.learning_rate': '1e-4..1e-2:log'}.")
    return [f"{name}={values}" for name, values in parameters.items()]


def _report(is_quiet: bool) -> Callable[[str], None]:
    return quiet if is_quiet else (lambda text: print(text, file=sys.stderr))


def _search(
    command: tuple[str, ...], parameters: dict[str, Parameter], request: TuneRequest, progress: Progress
) -> TunedSettings:
    """Try, and leave the page and the record of what was tried."""
    from racecraft.formats.atomic import make_folder
    from racecraft.jobs.capacity import Capacity
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.tuning.dry_run import require_understood
    from racecraft.jobs.tuning.search import search
    from racecraft.jobs.tuning.study import Study, as_database_errors, check_choices, require_search
    from racecraft.jobs.tuning.training_trials import TrainingTrials

    extent, aim, choice, place = request.extent, request.aim, request.choice, request.place
    pruner, folder, objective = choice.gives_up(aim), place.folder(), aim.of_trials()
    check_choices(choice.sampler, pruner, PBT)
    if place.from_ is not None:
        require_search(place.from_)
    require_understood(command, parameters)
    make_folder(folder)
    with as_database_errors(folder):
        study = Study(folder, parameters, objective.maximise, choice.sampler, pruner, choice.seed)
        if place.from_ is not None:
            with as_database_errors(place.from_):
                taken = study.take_over(place.from_)
            progress(f"begins with {taken} trials of {place.from_}")
        cores = Capacity.of_machine().cores
        at_a_time = extent.at_a_time(cores)
        launch = TrainingTrials(folder, command, objective, max(1, cores // at_a_time), JobPaths.of_user())
        progress(f"{folder}: {extent.trials} trials, {at_a_time} at a time")
        try:
            search(study, launch, extent.trials, at_a_time, lambda one: progress(_line(one, study)), find=launch.find)
        finally:
            record = _leave(folder, study, objective, parameters, command)
        return TunedSettings(folder, study, record)


def _refuse_given(request: TuneRequest, names: tuple[str, ...], reason: str) -> None:
    """Refuse options that were given and would be ignored."""
    given = {**request.extent.given(), **request.aim.given(), **request.choice.given(), **request.place.given()}
    for name in names:
        if name in given:
            raise SettingError("{name}: {reason}; expected it left out.", name=name, reason=reason)


def _leave(
    folder: Path, study: Study, aim: Objective, parameters: dict[str, Parameter], words: tuple[str, ...]
) -> TuningRecord:
    """Write the page, and every trial as a file that a program reads; return the record of them."""
    from racecraft.analysis.tuning_page import write_tuning_page
    from racecraft.formats.tuning import FILE, write_tuning

    record = _record(study, aim, words)
    log_scale = [name for name, one in parameters.items() if getattr(one, "is_log", False)]
    title = f"Tuning {folder.name}: {' '.join(words)}"
    write_tuning_page(folder / PAGE, record, title, log_scale, _best_command(study, words))
    write_tuning(folder / FILE, record)
    return record


def _record(study: Study, aim: Objective, words: tuple[str, ...]) -> TuningRecord:
    from racecraft.formats.tuning import TuningRecord

    return TuningRecord(words, aim.name, aim.maximise, aim.take_last, study.trials(), study.importances())


def _best_command(study: Study, words: tuple[str, ...]) -> str:
    from racecraft.jobs.tuning.space import as_text

    best = study.best()
    if best is None:
        return ""
    sets = (f"--set={name}={as_text(value)}" for name, value in best.values.items())
    return " \\\n  ".join([shlex.join(["racecraft", *words]), *map(shlex.quote, sets)])


def _next_folder(place: Path) -> Path:
    number = 1
    while (place / str(number)).exists():
        number += 1
    return place / str(number)


def _line(one: TrialRecord, study: Study) -> str:
    from racecraft.analysis.tuning_page import plain

    values = ", ".join(f"{name}={plain(value)}" for name, value in one.values.items())
    best = study.best()
    text = f"{one.state} {plain(one.score)}" if one.score is not None else f"{one.state}: {one.note}"
    return f"trial {one.number} | {text} | {values}" + (
        "" if best is None else f" | best {plain(best.score)} ({best.number})"
    )
