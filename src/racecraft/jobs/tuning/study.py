"""The only importer of Optuna: what is tried next, what is given up, what mattered. Begin with `Study`.

A study lies in a file of its own (`study.sqlite`, Optuna's tables), so that a search goes on where it was broken off,
and Optuna's own dashboard reads it.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import sqlite3
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.errors import MissingExtraError, RacecraftError, SettingError, UserInputError, nearest
from racecraft.formats.tuning import COMPLETE, FAILED, PRUNED, RUNNING, TrialRecord, best_of
from racecraft.jobs.tuning.space import CategoricalParameter, IntegerParameter, Parameter

if TYPE_CHECKING:
    import optuna

FILE = "study.sqlite"
NAME = "racecraft"
TAKEN_FROM = "taken_from"
SAMPLERS = {
    "tpe": "what did well is tried near by (tree-structured Parzen estimator)",
    "random": "anything, evenly",
    "grid": "every combination of listed values once",
}
PRUNERS = {
    "median": "a trial worse than half of the others at the same iteration is given up",
    "hyperband": "many trials are begun, and few brought to their end",
    "none": "every trial runs to its end",
}
FIRST_TRIALS = 4
"""Trials that are never given up: there is too little to compare them with."""

ENOUGH_TO_JUDGE = 10
"""Trials that are done before anything is said of what mattered."""


class TuningError(UserInputError):
    """A search for settings cannot be begun or gone on with."""


@contextlib.contextmanager
def as_database_errors(folder: Path) -> Iterator[None]:
    """Say as an error what befell a search's database: the disk is full, or the file is damaged or no database.

    Raises:
        TuningError: SQLite said so, however many libraries have wrapped it since.
    """
    try:
        yield
    except RacecraftError:  # already an error of ours
        raise
    except Exception as error:
        first: BaseException | None = error
        while first is not None and not isinstance(first, sqlite3.Error):
            first = first.__cause__ or first.__context__
        if first is None:
            raise
        hint = "Free some space" if "full" in str(first) else "Give another --run, or put a sound file there"
        raise TuningError(
            "{folder}: {first}; expected a search's database that can be read and written. {hint} and run the "
            "same command again.",
            folder=folder / FILE,
            first=first,
            hint=hint,
        ) from error


def check_choices(sampler: str, pruner: str, *other_samplers: str) -> None:
    """Refuse who is not here, before anything is made.

    Args:
        sampler: Who says what is tried next.
        pruner: Who gives trials up early.
        other_samplers: Who could be named, too, and is not a study's.

    Raises:
        SettingError: There is no such sampler, or no such pruner.
    """
    samplers = (*SAMPLERS, *other_samplers)
    for chosen, known, option in ((sampler, samplers, "sampler"), (pruner, tuple(PRUNERS), "pruner")):
        if chosen not in known:
            raise SettingError(
                "no {option} '{chosen}'; expected one of {known}. {hint}",
                option=option,
                chosen=chosen,
                known=", ".join(known),
                hint=nearest(chosen, known),
            )


def require_search(folder: Path) -> None:
    """Refuse a folder without a search.

    Raises:
        TuningError: No search lies there.
    """
    if not (folder / FILE).is_file():
        raise TuningError(
            "{folder}: holds no {file}; expected the folder of an earlier `racecraft tune`.", folder=folder, file=FILE
        )


class Study:
    """What has been tried, and what will be.

    Args:
        folder: Where its file lies or will lie.
        parameters: What may be varied.
        maximise: Whether more is better.
        sampler: One of SAMPLERS.
        pruner: One of PRUNERS.
        seed: Of the sampler.

    Raises:
        MissingExtraError: Optuna is not installed.
        SettingError: An unknown sampler or pruner, or a grid over a range.
        TuningError: The file there is of another search.
    """

    def __init__(
        self,
        folder: Path,
        parameters: Mapping[str, Parameter],
        maximise: bool = True,
        sampler: str = "tpe",
        pruner: str = "median",
        seed: int = 0,
    ) -> None:
        self.parameters, self.maximise = dict(parameters), maximise
        optuna = _optuna()
        check_choices(sampler, pruner)
        self._spaces = {name: _distribution(optuna, one) for name, one in self.parameters.items()}
        if sampler == "grid":
            _grid(self.parameters)  # an error comes before a file
        direction = "maximize" if maximise else "minimize"
        self._study = optuna.create_study(
            storage=_storage(optuna, folder),
            sampler=_sampler(optuna, sampler, seed),
            pruner=_pruner(optuna, pruner),
            study_name=NAME,
            direction=direction,
            load_if_exists=True,
        )
        self._require_same(folder, direction)
        self.most_trials: int | None = None
        """How many there are to be tried at all: of a grid its combinations; None: no end."""
        if sampler == "grid":
            combinations = _grid(self.parameters)
            self.most_trials = len(combinations)
            for values in combinations:
                self._study.enqueue_trial(values, skip_if_exists=True)

    def ask(self) -> tuple[int, dict[str, Any]]:
        """Return the number of the next trial, and what it tries."""
        trial = self._study.ask(self._spaces)
        return trial.number, dict(trial.params)

    def report(self, number: int, score: float, iteration: int) -> bool:
        """Note how a trial stands; tell whether it is to be given up."""
        trial = self._live(number)
        trial.report(score, iteration)
        return bool(trial.should_prune())

    def reported(self, number: int) -> int:
        """Return how many scores of a trial were reported."""
        return len(self._study.get_trials(deepcopy=False)[number].intermediate_values)

    def finish(self, number: int, state: str, score: float | None = None, note: str = "") -> None:
        """End a trial as COMPLETE, PRUNED or FAILED; one that is done has a score."""
        optuna = _optuna()
        states = optuna.trial.TrialState
        to = {COMPLETE: states.COMPLETE, PRUNED: states.PRUNED, FAILED: states.FAIL}[state]
        if note:
            self._live(number).set_user_attr("note", note)
        self._study.tell(number, score if state == COMPLETE else None, to)

    def trials(self) -> list[TrialRecord]:
        """Return every trial in the order of its number."""
        waiting = _optuna().trial.TrialState.WAITING
        return [_record(one) for one in self._study.get_trials(deepcopy=False) if one.state != waiting]

    def best(self) -> TrialRecord | None:
        """Return the best trial that is done; of equals the first; None without one."""
        return best_of(self.trials(), self.maximise)

    def importances(self) -> dict[str, float]:
        """Return how much of what tells good trials from others each parameter decides, shares of 1 (PED-ANOVA).

        {} before ENOUGH_TO_JUDGE trials are done: of fewer it tells chance.
        """
        optuna = _optuna()
        scores = [one.score for one in self.trials() if one.state == COMPLETE]
        if len(scores) < ENOUGH_TO_JUDGE or len(set(scores)) < 3:
            return {}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = optuna.importance.get_param_importances(
                self._study, evaluator=optuna.importance.PedAnovaImportanceEvaluator()
            )
        return {name: float(share) for name, share in found.items() if math.isfinite(share)}

    def take_over(self, folder: Path) -> int:
        """Begin with what an earlier search found; return how many of its trials fit. Each is taken over once.

        Raises:
            TuningError: No search lies there.
        """
        optuna = _optuna()
        require_search(folder)
        earlier = optuna.load_study(study_name=NAME, storage=_storage(optuna, folder))
        known = {one.taken_from for one in self.trials()}
        taken = 0
        for one in earlier.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,)):
            taken_from = one.user_attrs.get(TAKEN_FROM, f"{folder.name}/{one.number}")
            if set(one.params) != set(self._spaces) or taken_from in known:
                continue
            if all(space._contains(space.to_internal_repr(one.params[name])) for name, space in self._spaces.items()):
                trial = optuna.trial.create_trial(
                    params=dict(one.params), distributions=dict(self._spaces), value=one.value,
                    user_attrs={TAKEN_FROM: taken_from},
                )  # fmt: skip
                self._study.add_trial(trial)
                taken += 1
        return taken

    def _live(self, number: int) -> optuna.trial.Trial:
        optuna = _optuna()
        return optuna.trial.Trial(self._study, self._study.get_trials(deepcopy=False)[number]._trial_id)

    def _require_same(self, folder: Path, direction: str) -> None:
        known = self._study.user_attrs.get("parameters")
        mine = {name: repr(one) for name, one in self.parameters.items()}
        if known is None:
            self._study.set_user_attr("parameters", mine)
        elif known != mine or self._study.direction.name.lower() != direction:
            raise TuningError(
                "{folder}: a search over {known} lies here already, with other bounds or another aim; "
                "expected the same, to go on with it. Give another --run, and --from to begin with what it found.",
                folder=folder,
                known=", ".join(known),
            )


def _optuna() -> Any:
    try:
        import optuna
    except ImportError as error:
        raise MissingExtraError("Tuning needs Optuna: pip install 'racecraft[tune]'.") from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


def _distribution(optuna: Any, one: Parameter) -> Any:
    spaces = optuna.distributions
    if isinstance(one, CategoricalParameter):
        return spaces.CategoricalDistribution(one.values)
    kind = spaces.IntDistribution if isinstance(one, IntegerParameter) else spaces.FloatDistribution
    return kind(one.min_value, one.max_value, log=one.is_log)


def _storage(optuna: Any, folder: Path) -> Any:
    """Return Optuna's tables in a folder; no connection outlives what it was opened for, so that nobody must close."""
    from sqlalchemy.pool import NullPool

    return optuna.storages.RDBStorage(f"sqlite:///{folder / FILE}", engine_kwargs={"poolclass": NullPool})


def _sampler(optuna: Any, name: str, seed: int) -> Any:
    if name == "tpe":
        return optuna.samplers.TPESampler(seed=seed, n_startup_trials=FIRST_TRIALS, constant_liar=True)
    return optuna.samplers.RandomSampler(seed=seed)  # of a grid every trial is told beforehand


def _grid(parameters: Mapping[str, Parameter]) -> list[dict[str, Any]]:
    """Return every combination of values."""
    for name, one in parameters.items():
        if not isinstance(one, CategoricalParameter):
            raise SettingError("{name} is a range, and a grid has values; expected {name}=ONE,OTHER,….", name=name)
    values = [one.values for one in parameters.values() if isinstance(one, CategoricalParameter)]
    return [dict(zip(parameters, chosen, strict=True)) for chosen in itertools.product(*values)]


def _pruner(optuna: Any, name: str) -> Any:
    if name == "median":
        return optuna.pruners.MedianPruner(n_startup_trials=FIRST_TRIALS, n_warmup_steps=1)
    return optuna.pruners.HyperbandPruner() if name == "hyperband" else optuna.pruners.NopPruner()


def _record(one: Any) -> TrialRecord:
    words = {"COMPLETE": COMPLETE, "PRUNED": PRUNED, "FAIL": FAILED}
    score = one.value if one.value is not None else one.intermediate_values.get(one.last_step)
    return TrialRecord(
        one.number,
        dict(one.params),
        words.get(one.state.name, RUNNING),
        score,
        one.duration.total_seconds() if one.duration is not None else None,
        str(one.user_attrs.get("note", "")),
        str(one.user_attrs.get(TAKEN_FROM, "")),
    )
