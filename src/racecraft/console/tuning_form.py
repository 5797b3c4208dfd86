"""What of a training may be varied, within which bounds, and the words of the search. Begin with `SearchForm`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from racecraft.actions.settings import DefaultSettings, settings
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.jobs.tuning.space import read_parameter
from racecraft.jobs.tuning.training_trials import check_command

RANGES: Mapping[str, str] = {
    "learning_rate": "1e-4..3e-3:log",
    "entropy_weight": "0.001..0.05:log",
    "discount": "0.9..0.999",
    "epochs": "2..8",
    "batch_size": "64,128,256,512",
    "gae_lambda": "0.9..1.0",
    "clip": "0.1..0.3",
    "n_step": "1..5",
}
"""Bounds within which a setting of a learner is worth trying, by the last part of its name, in this order."""
CHECKED_FIRST = ("learning_rate", "entropy_weight")
MAX_TRIALS, MAX_MINUTES = 1000, 1440.0
OWN_WORDS = ("--run", "--stop")
OWN_SWITCHES = ("--resume", "--detach")


@dataclass(frozen=True, kw_only=True)
class Offer:
    """A setting that can be varied."""

    name: str
    """As --set takes it."""
    range: str
    """As `racecraft tune --param` takes it."""
    default: str
    doc: str

    def as_dictionary(self) -> dict[str, str]:
        """Return it as plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class SearchForm:
    """What the form of a search holds, as typed."""

    model: str = ""
    chosen: tuple[str, ...] = ()
    """Settings that are varied."""
    ranges: Mapping[str, str] = field(default_factory=dict)
    more: str = ""
    """Further NAME=LOW..HIGH, one a line."""
    trials: str = "20"
    minutes: str = "2"
    parallel: str = ""

    @classmethod
    def of(cls, fields: Mapping[str, list[str]]) -> SearchForm:
        """Return what was sent."""
        told = {name: values[-1].strip() for name, values in fields.items()}
        ranges = {name.removeprefix("range:"): told[name] for name in told if name.startswith("range:")}
        words = {name: told[name] for name in ("model", "more", "trials", "minutes", "parallel") if name in told}
        return cls(chosen=tuple(fields.get("vary", ())), ranges=ranges, **words)

    def as_dictionary(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)

    def command(self, trained: Sequence[str]) -> list[str]:
        """Return the words behind `racecraft tune`, --run left out.

        Args:
            trained: Words behind `racecraft` that trained the model.

        Raises:
            SettingError: Something that was typed cannot be used.
        """
        params = [f"{name}={self.ranges.get(name, '')}" for name in self.chosen]
        params += [line.strip() for line in self.more.splitlines() if line.strip()]
        if not params:
            raise SettingError("Nothing is varied; expected a setting or more.")
        names = [read_parameter(text)[0] for text in params]
        if twice := next((name for name in names if names.count(name) > 1), ""):
            raise SettingError("{name}: is varied twice; expected it once.", name=twice)
        trials = _number("Trials", self.trials, 1, MAX_TRIALS)
        minutes = _number("Minutes of a trial", self.minutes, 0.05, MAX_MINUTES)
        parallel = [f"--parallel={_number('At a time', self.parallel, 1, MAX_TRIALS):.0f}"] if self.parallel else []
        words = check_command([*_without_own(trained), f"--stop=minutes={minutes:g}"])
        return [f"--trials={trials:.0f}", *parallel, *(f"--param={text}" for text in params), *words]


def offers(kind: str, algorithm: str) -> list[Offer]:
    """Return the settings of a learner that are worth varying, in the order of `RANGES`; none: it is not ours."""
    try:
        known = settings(world=kind, algorithm=algorithm)
    except UserInputError:
        return []
    if not isinstance(known, DefaultSettings):
        return []
    rows = {row.name: (row, value) for row, value in known.rows() if row.group == algorithm}
    return [
        Offer(name=rows[name][0].full_name, range=range_, default=str(rows[name][1]), doc=rows[name][0].doc)
        for name, range_ in RANGES.items()
        if name in rows
    ]


def _without_own(words: Sequence[str]) -> Iterator[str]:
    """Yield the words of a training command without those that every trial has of its own."""
    left = iter(words)
    for word in left:
        if word in OWN_WORDS:
            next(left, "")
        elif word.partition("=")[0] not in OWN_WORDS and word not in OWN_SWITCHES:
            yield word


def _number(label: str, typed: str, low: float, high: float) -> float:
    """Return a number that was typed with a point or a comma.

    Raises:
        SettingError: It is none, or out of range.
    """
    try:
        value = float(typed.replace(",", "."))
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise SettingError(
            "{label}: found {typed!r}; expected a number from {low:g} to {high:g}.",
            label=label, typed=typed[:40], low=low, high=high,
        )  # fmt: skip
    return value
