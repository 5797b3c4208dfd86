"""`racecraft tune`: look for the settings that train best."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.jobs.jobs import WORDS
from racecraft.cli.option_groups import takes_groups
from racecraft.cli.options import Json

if TYPE_CHECKING:
    from racecraft.formats.tuning import TrialRecord
    from racecraft.jobs.tuning.space import Parameter
    from racecraft.jobs.tuning.study import Study
    from racecraft.jobs.tuning.training_trials import Objective

PAGE, SPEC = "tuning.html", "tuning.json"


@dataclass(frozen=True)
class Extent:
    """How much is tried."""

    trials: Annotated[int, typer.Option(min=1, help="How many in all, those of --from beside them.")] = 20
    parallel: Annotated[
        int | None,
        typer.Option(min=1, help="How many at a time; by default one for every two cores, and no less than one."),
    ] = None

    def at_a_time(self, cores: int) -> int:
        """Return how many trials run side by side."""
        return self.parallel or max(1, cores // 2)


@dataclass(frozen=True)
class Aim:
    """What counts."""

    objective: Annotated[
        str,
        typer.Option(
            help="A column of metrics.jsonl, or a regular expression over the log, such as 'reward=([0-9.]+)'."
        ),
    ] = "evaluation_score"
    minimize: Annotated[bool, typer.Option("--minimize", help="Less is better.")] = False
    last: Annotated[
        bool, typer.Option("--last", help="The last figure counts and not the best; nothing is given up early.")
    ] = False

    def told(self) -> Objective:
        """Return it as trials are judged by it."""
        from racecraft.jobs.tuning.training_trials import Objective

        return Objective(self.objective, not self.minimize, self.last)


@dataclass(frozen=True)
class Choice:
    """Who says what is tried next, and what is given up."""

    sampler: Annotated[
        str,
        typer.Option(
            help="Who says what is tried next: tpe, random or grid; or pbt, a population that trains in rounds, in "
            "which bad members take over weights and settings of good ones."
        ),
    ] = "tpe"
    population: Annotated[int, typer.Option(help="Members of the population (pbt).")] = 4
    rounds: Annotated[int, typer.Option(help="Rounds that it trains, each to the command's --stop (pbt).")] = 5
    pruner: Annotated[
        str | None, typer.Option(help="Who gives trials up early: median (where nobody says), hyperband or none.")
    ] = None
    seed: Annotated[int, typer.Option(min=0, help="Of the sampler.")] = 0

    def gives_up(self, aim: Aim) -> str:
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


@dataclass(frozen=True)
class Place:
    """Where the search lies, and what it begins with."""

    run: Annotated[
        Path | None, typer.Option(help="Folder of the search; one that is there is gone on with. By default tunings/N.")
    ] = None
    from_: Annotated[
        Path | None, typer.Option("--from", help="Folder of an earlier search, whose trials this one begins with.")
    ] = None

    def folder(self) -> Path:
        """Return the folder of the search."""
        return self.run or _next_folder(Path("tunings"))


@takes_groups
def tune(
    context: typer.Context,
    words: Annotated[
        list[str],
        typer.Argument(metavar="COMMAND…", help="A training command, the words behind `racecraft`; with --stop."),
    ],
    param: Annotated[
        list[str],
        typer.Option(
            help="What is varied: NAME=LOW..HIGH, with :log behind it for a logarithmic scale, or NAME=ONE,OTHER."
        ),
    ],
    extent: Extent,
    aim: Aim,
    choice: Choice,
    place: Place,
    json: Json = False,
) -> None:
    """Train many times with other settings each, and find those that do best.

    Every trial is a job; its run lies in the search's folder. Ctrl-C ends the search, and the same command with --run
    goes on with it.

    Examples:

        racecraft tune --param ppo.learning_rate=1e-4..1e-2:log gym train CartPole-v1 --stop minutes=0.5

        racecraft tune --objective seconds --minimize --last --param ppo.epochs=2..6 train --stop laps --stop minutes=1

        racecraft tune --run tunings/1 --trials 40 --param network.activation=relu,tanh train my-car --stop minutes=1

        racecraft tune --sampler pbt --param ppo.learning_rate=1e-4..1e-2:log snakes train --stop minutes=2
    """
    from racecraft.cli.jobs.population import NOT_OF_POPULATIONS, PBT, train_population
    from racecraft.contract.errors import SettingError
    from racecraft.formats.population import PopulationRecord
    from racecraft.jobs.tuning.space import read_parameter
    from racecraft.jobs.tuning.training_trials import check_command

    command = check_command(words)
    parameters = dict(read_parameter(one) for one in param)
    if len(parameters) < len(param):
        raise SettingError("a --param is given twice; expected every name once.")
    if choice.sampler == PBT:
        _refuse_given(context, NOT_OF_POPULATIONS, f"--sampler {PBT} has a population and rounds")
        told = dict(one.split("=", 1) for one in param)
        record = PopulationRecord(
            command, aim.objective, not aim.minimize, told, choice.population, choice.rounds, choice.seed
        )
        return train_population(record, parameters, place.folder(), extent.parallel, json)
    _refuse_given(context, ("population", "rounds"), f"only --sampler {PBT} has a population")
    _search(command, parameters, extent, aim, choice, place, json)


def _search(
    command: tuple[str, ...],
    parameters: dict[str, Parameter],
    extent: Extent,
    aim: Aim,
    choice: Choice,
    place: Place,
    json: bool,
) -> None:
    """Try, and leave the page and the record of what was tried."""
    from racecraft.cli.jobs.population import PBT
    from racecraft.cli.output import say
    from racecraft.formats.atomic import make_folder
    from racecraft.jobs.capacity import Capacity
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.tuning.dry_run import require_understood
    from racecraft.jobs.tuning.search import search
    from racecraft.jobs.tuning.study import Study, check_choices, database_letters, require_search
    from racecraft.jobs.tuning.training_trials import TrainingTrials

    pruner, folder, objective = choice.gives_up(aim), place.folder(), aim.told()
    check_choices(choice.sampler, pruner, PBT)
    if place.from_ is not None:
        require_search(place.from_)
    require_understood(command, parameters)
    make_folder(folder)
    with database_letters(folder):
        study = Study(folder, parameters, objective.maximise, choice.sampler, pruner, choice.seed)
        if place.from_ is not None:
            with database_letters(place.from_):
                taken = study.take_over(place.from_)
            say(f"begins with {taken} trials of {place.from_}", quiet_stdout=json)
        cores = Capacity.of_machine().cores
        at_a_time = extent.at_a_time(cores)
        launch = TrainingTrials(folder, command, objective, max(1, cores // at_a_time), JobPaths.of_user())
        say(f"{folder}: {extent.trials} trials, {at_a_time} at a time", quiet_stdout=json)
        try:
            search(study, launch, extent.trials, at_a_time, lambda one: say(_line(one, study), quiet_stdout=json))
        finally:
            _leave(folder, study, objective, parameters, command)
        _tell(folder, study, json)


def _refuse_given(context: typer.Context, names: tuple[str, ...], because: str) -> None:
    """Refuse options that were typed and would be ignored."""
    from racecraft.contract.errors import SettingError

    for name in names:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            raise SettingError("--{name}: {because}; expected it left out.", name=name.strip("_"), because=because)


def _next_folder(place: Path) -> Path:
    number = 1
    while (place / str(number)).exists():
        number += 1
    return place / str(number)


def _line(one: TrialRecord, study: Study) -> str:
    from racecraft.analysis.tuning_page import plain

    values = ", ".join(f"{name}={plain(value)}" for name, value in one.values.items())
    best = study.best()
    told = f"{one.state} {plain(one.score)}" if one.score is not None else f"{one.state}: {one.note}"
    return f"trial {one.number} | {told} | {values}" + (
        "" if best is None else f" | best {plain(best.score)} ({best.number})"
    )


def _leave(
    folder: Path, study: Study, aim: Objective, parameters: dict[str, Parameter], words: tuple[str, ...]
) -> None:
    """Write the page, and every trial as a file that a program reads."""
    from racecraft.analysis.tuning_page import write_tuning_page
    from racecraft.formats.tuning import TuningRecord, write_tuning

    record = TuningRecord(words, aim.name, aim.maximise, aim.take_last, study.trials(), study.importances())
    log_scale = [name for name, one in parameters.items() if getattr(one, "is_log", False)]
    title = f"Tuning {folder.name}: {' '.join(words)}"
    write_tuning_page(folder / PAGE, record, title, log_scale, _best_command(study, words))
    write_tuning(folder / SPEC, record)


def _best_command(study: Study, words: tuple[str, ...]) -> str:
    from racecraft.jobs.tuning.space import as_text

    best = study.best()
    if best is None:
        return ""
    sets = (f"--set={name}={as_text(value)}" for name, value in best.values.items())
    return " \\\n  ".join([shlex.join(["racecraft", *words]), *map(shlex.quote, sets)])


def _tell(folder: Path, study: Study, json: bool) -> None:
    from racecraft.cli.output import print_json

    best = study.best()
    if json:
        told: dict[str, Any] = {"tuning": str(folder), "trials": len(study.trials()), "page": str(folder / PAGE)}
        told["best"] = (
            None if best is None else {"number": best.number, "score": best.score, "values": dict(best.values)}
        )
        print_json(told)
        return
    if best is None:
        print("no trial came to a score")
        return
    from racecraft.analysis.tuning_page import plain

    print(f"best: trial {best.number}, {plain(best.score)}")
    for name, value in best.values.items():
        print(f"  {name} = {plain(value)}")
    for name, share in sorted(study.importances().items(), key=lambda one: -one[1]):
        print(f"  {name} decides {100 * share:.0f} %")
    print(f"page: {folder / PAGE}")


CONTEXT = WORDS
"""What follows the first word is the training command's own."""
