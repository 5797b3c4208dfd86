"""`hyperparameters.json`: how a car learns.

Begin with `read_hyperparameters`. A value that the file does not give is None here; what stands in for it is the
preset's choice, not this room's. What could never train is refused; what only the consoles of AWS would refuse is
accepted with a note, because DeepRacer-for-Cloud never checked it and its folders shall train unchanged.

Source: facts: simapp `sagemaker_graph_manager.py` (names, defaults), DeepRacer-on-AWS `model.smithy` (console limits).
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import Faults, HyperparameterError, nearest
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import JsonDocument, as_number, read_json

_KIND = "a JSON object with hyperparameters"


@dataclass(frozen=True)
class Hyperparameters:
    """What the file gives; None where it gives nothing."""

    batch_size: int | None = None
    """Steps in one minibatch."""
    beta_entropy: float | None = None
    """Weight of the entropy bonus, 0 to 1."""
    discount_factor: float | None = None
    """Weight of the next step's value (gamma), 0 to 1."""
    e_greedy_value: float | None = None
    """Final share of random actions, 0 to 1; only with e-greedy exploration."""
    epsilon_steps: int | None = None
    """Steps until that share is reached; only with e-greedy exploration."""
    exploration_type: str | None = None
    """"categorical", "e-greedy" or "additive_noise"."""
    loss_type: str | None = None
    """Loss of the critic: "huber" or "mean squared error"."""
    lr: float | None = None
    """Adam's step size."""
    num_episodes_between_training: int | None = None
    """Episodes of one iteration, all workers together."""
    num_epochs: int | None = None
    """Passes over each iteration's steps."""
    stack_size: int | None = None
    """Frames stacked; ignored by AWS, and by us."""
    term_cond_avg_score: float | None = None
    """Stop above this mean reward of the latest episodes; AWS ignored it. A template's value stops nothing."""
    term_cond_max_episodes: int | None = None
    """Stop after so many episodes; AWS counted iterations. A template's value stops nothing."""
    sac_alpha: float | None = None
    """Entropy temperature of SAC, 0 to 1."""
    unknown: Mapping[str, Any] = field(default_factory=dict)
    """Keys we do not know, kept as they were."""
    notes: tuple[str, ...] = field(default=(), compare=False)
    """What is worth telling the user, a clause each."""

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the values that the file gives.

        >>> Hyperparameters(lr=0.001, num_epochs=4).given
        ('lr', 'num_epochs')
        """
        return tuple(name for name in NAMES if getattr(self, name) is not None)


@dataclass(frozen=True)
class _Rule:
    """What a value may be."""

    whole: bool
    low: float
    high: float
    console: tuple[float, float] | tuple[int, ...] = ()
    """What the consoles take: a range, or (three or more numbers) the only choices."""


RULES: Mapping[str, _Rule] = {
    "batch_size": _Rule(True, 1, 1_000_000, (32, 64, 128, 256, 512)),
    "beta_entropy": _Rule(False, 0, 1),
    "discount_factor": _Rule(False, 0, 1),
    "e_greedy_value": _Rule(False, 0, 1),
    "epsilon_steps": _Rule(True, 1, 1_000_000_000),
    "lr": _Rule(False, 1e-8, 1, (1e-8, 1e-3)),
    "num_episodes_between_training": _Rule(True, 1, 100_000, (1, 100)),
    "num_epochs": _Rule(True, 1, 100, (3, 10)),
    "stack_size": _Rule(True, 1, 64),
    "term_cond_avg_score": _Rule(False, -1e9, 1e9),
    "term_cond_max_episodes": _Rule(True, 1, 1_000_000_000),
    "sac_alpha": _Rule(False, 0, 1),
}
NAMES = tuple(part.name for part in dataclasses.fields(Hyperparameters) if part.name not in ("unknown", "notes"))
TEMPLATE_VALUES: Mapping[str, tuple[float, ...]] = {
    "term_cond_avg_score": (350, 1000, 100_000),
    "term_cond_max_episodes": (1000, 5000, 100_000),
}
"""Values that stand in every template and that nobody chose."""

_OTHER_SPELLINGS = {"ir": "lr", "learning_rate": "lr", "e_greedy": "e_greedy_value", "entropy": "beta_entropy"}
_WORDS = {
    "loss_type": {
        "huber": "huber",
        "mean squared error": "mean squared error",
        "mse": "mean squared error",
    },
    "exploration_type": {
        "categorical": "categorical",
        "e greedy": "e-greedy",
        "egreedy": "e-greedy",
        "epsilon greedy": "e-greedy",
        "additive noise": "additive_noise",
    },
}


def default_hyperparameters() -> Hyperparameters:
    """Return what DeepRacer for Cloud puts into a new file, without the values that do nothing."""
    return Hyperparameters(
        batch_size=64,
        beta_entropy=0.01,
        discount_factor=0.99,
        exploration_type="categorical",
        loss_type="huber",
        lr=0.0003,
        num_episodes_between_training=20,
        num_epochs=5,
    )


def read_hyperparameters(path: str | Path) -> Hyperparameters:
    """Read how a car learns.

    Numbers may be written as text, words in any case and with any of blank, hyphen, underscore; keys we do not know
    are kept and named in `notes`.

    Raises:
        HyperparameterError: The file is missing or no JSON, or a value is of the wrong kind or out of range; the
            letter names file, line and key.
        SeveralFaultsError: Several values are.
    """
    document = read_json(path, HyperparameterError, _KIND)
    if not isinstance(document.value, dict):
        raise HyperparameterError(path, "the file holds no JSON object", _KIND, line=1)
    notes = list(document.notes)
    values: dict[str, Any] = {}
    unknown: dict[str, Any] = {}
    faults = Faults()
    for key, written in document.value.items():
        name = _name_of(key, notes)
        if name is None:
            unknown[key] = written
        elif written is not None:
            with faults.collect():
                values[name] = _read_value(document, key, name, notes)
    faults.raise_found()
    return replace(Hyperparameters(**values), unknown=unknown, notes=tuple(notes))


def write_hyperparameters(hyperparameters: Hyperparameters, path: str | Path) -> None:
    """Write what is given, and the unknown keys that were kept.

    Raises:
        OutputFileError: The file cannot be written.
    """
    values = {name: getattr(hyperparameters, name) for name in hyperparameters.given}
    write_atomic(path, json.dumps({**values, **hyperparameters.unknown}, indent=2) + "\n")


def _name_of(key: str, notes: list[str]) -> str | None:
    """Return the name a key means, None for a key we do not know."""
    folded = key.strip().casefold().replace("-", "_").replace(" ", "_")
    name = _OTHER_SPELLINGS.get(folded, folded)
    if name not in NAMES:
        hint = nearest(key, NAMES)
        near = f". {hint}" if hint.startswith("Did you mean") else ""
        notes.append(f"unknown key '{key}' is kept and does nothing{near}")
        return None
    if name != key:
        notes.append(f"'{key}' is read as '{name}'")
    return name


def _read_value(document: JsonDocument, key: str, name: str, notes: list[str]) -> Any:
    written = document.value[key]
    if name in _WORDS:
        return _read_word(document, key, name)
    rule, number = RULES[name], as_number(written)
    if number is None or not rule.low <= number <= rule.high or (rule.whole and number != int(number)):
        raise document.error_at(key, found=repr(written), expected=_expected(rule))
    value = int(number) if rule.whole else float(number)
    if value in TEMPLATE_VALUES.get(name, ()):
        notes.append(f"{name} {value:g} is a template's value and stops nothing")
        return None
    outside = _outside_console(rule, value)
    if outside:
        notes.append(f"{name} {value:g} trains here; AWS consoles take {outside}")
    return value


def _read_word(document: JsonDocument, key: str, name: str) -> str:
    written = document.value[key]
    folded = str(written).strip().casefold().replace("_", " ").replace("-", " ")
    known = _WORDS[name]
    if not isinstance(written, str) or folded not in known:
        names = sorted(set(known.values()))
        raise document.error_at(
            key, found=repr(written), expected=" or ".join(names), hint=nearest(str(written), names)
        )
    return known[folded]


def _expected(rule: _Rule) -> str:
    return f"a {'whole ' if rule.whole else ''}number from {rule.low:g} to {rule.high:g}"


def _outside_console(rule: _Rule, value: float) -> str:
    """Return what the consoles take when the value is outside of it, else nothing."""
    if len(rule.console) == 2:
        low, high = rule.console
        return "" if low <= value <= high else f"{low:g} to {high:g}"
    if rule.console and value not in rule.console:
        return ", ".join(f"{choice:g}" for choice in rule.console)
    return ""
