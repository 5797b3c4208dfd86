"""What may be varied, and within which bounds. Begin with `read_parameter`; the names are SageMaker's.

ppo.learning_rate=1e-5..1e-2:log     a number, tried evenly over its logarithm
ppo.epochs=2..8                      a whole number, as both ends are
network.activation=relu,tanh         one of these
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import SettingError

LOG = "log"
SCALES = ("Auto", "Linear", "Logarithmic")
"""SageMaker's scaling types that are followed; `ReverseLogarithmic` is none of ours."""
_WHOLE = re.compile(r"[+-]?\d+")


@dataclass(frozen=True)
class ContinuousParameter:
    """A number between two others.

    Args:
        min_value: The least.
        max_value: The greatest.
        scaling_type: "Logarithmic": evenly over the logarithm; "Auto" and "Linear": evenly.

    Raises:
        SettingError: The bounds are none, or the scale is unknown.
    """

    min_value: float
    max_value: float
    scaling_type: str = "Auto"

    def __post_init__(self) -> None:
        _check(self.min_value, self.max_value, self.scaling_type)

    @property
    def is_log(self) -> bool:
        """Whether it is tried evenly over its logarithm."""
        return self.scaling_type == "Logarithmic"


@dataclass(frozen=True)
class IntegerParameter:
    """A whole number between two others, both in; the same arguments and errors as `ContinuousParameter`."""

    min_value: int
    max_value: int
    scaling_type: str = "Auto"

    def __post_init__(self) -> None:
        _check(self.min_value, self.max_value, self.scaling_type)
        if int(self.min_value) != self.min_value or int(self.max_value) != self.max_value:
            raise SettingError(
                "{min_value}..{max_value}: expected whole numbers.", min_value=self.min_value, max_value=self.max_value
            )

    @property
    def is_log(self) -> bool:
        """Whether it is tried evenly over its logarithm."""
        return self.scaling_type == "Logarithmic"


@dataclass(frozen=True)
class CategoricalParameter:
    """One of several values.

    Raises:
        SettingError: There are none.
    """

    values: tuple[Any, ...]

    def __init__(self, values: Sequence[Any]) -> None:
        object.__setattr__(self, "values", (values,) if isinstance(values, str) else tuple(values))
        if not self.values:
            raise SettingError("A parameter has no values; expected one or more.")


Parameter = ContinuousParameter | IntegerParameter | CategoricalParameter


def read_parameter(text: str) -> tuple[str, Parameter]:
    """Return a parameter as it is typed, with its name.

    Raises:
        SettingError: It cannot be read.

    >>> read_parameter("ppo.learning_rate=1e-5..1e-2:log")
    ('ppo.learning_rate', ContinuousParameter(min_value=1e-05, max_value=0.01, scaling_type='Logarithmic'))
    >>> read_parameter("ppo.epochs=2..8")
    ('ppo.epochs', IntegerParameter(min_value=2, max_value=8, scaling_type='Auto'))
    >>> read_parameter("network.activation=relu,tanh")
    ('network.activation', CategoricalParameter(values=('relu', 'tanh')))
    """
    name, sign, range_text = text.partition("=")
    if not sign or not name.strip() or not range_text.strip():
        raise SettingError("--param {text}: {expected}", text=text, expected=_EXPECTED)
    name, range_text = name.strip(), range_text.strip()
    if ".." not in range_text:
        return name, CategoricalParameter(tuple(one.strip() for one in range_text.split(",") if one.strip()))
    bounds, _, scale = range_text.partition(":")
    if scale not in ("", LOG):
        raise SettingError("--param {text}: no scale '{scale}'; {expected}", text=text, scale=scale, expected=_EXPECTED)
    ends = [one.strip() for one in bounds.split("..")]
    try:
        low, high = (float(one) for one in ends)
    except ValueError:
        raise SettingError("--param {text}: {expected}", text=text, expected=_EXPECTED) from None
    scaling = "Logarithmic" if scale else "Auto"
    if all(_WHOLE.fullmatch(one) for one in ends):
        return name, IntegerParameter(int(low), int(high), scaling)
    return name, ContinuousParameter(low, high, scaling)


def as_text(value: Any) -> str:
    """Return a value as --set takes it; a number with as many digits as it has.

    >>> as_text(0.00031), as_text(8), as_text(True), as_text("relu")
    ('0.00031', '8', 'true', 'relu')
    """
    return str(value).lower() if isinstance(value, bool) else str(value)


_EXPECTED = "expected NAME=LOW..HIGH, NAME=LOW..HIGH:log or NAME=ONE,OTHER, such as ppo.learning_rate=1e-5..1e-2:log."


def _check(low: float, high: float, scale: str) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise SettingError("{low:g}..{high:g} is no range; expected two numbers, the lesser first.", low=low, high=high)
    if scale not in SCALES:
        raise SettingError("scaling_type {scale!r}; expected one of {scales}.", scale=scale, scales=", ".join(SCALES))
    if scale == "Logarithmic" and low <= 0:
        raise SettingError(
            "{low:g}..{high:g} on a logarithmic scale; expected a lower end above 0.", low=low, high=high
        )
