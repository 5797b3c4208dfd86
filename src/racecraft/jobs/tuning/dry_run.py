"""A training command read through before it becomes a job, so that what it does not understand is said at once.

The command itself reads it, in a process of its own that plans and trains nothing (`PLAN_ONLY`). Two corners of what is
varied are planned, all least values and all greatest: where one of them can be trained, a search has something to find,
and what the other one does wrong is a trial's own failure.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.jobs.follow import ERROR_PREFIX
from racecraft.jobs.tuning.space import CategoricalParameter, Parameter, as_text

PLAN_ONLY = "RACECRAFT_PLAN_ONLY"
"""Set, it makes a training command read everything, write nothing and leave."""


_BOX = re.compile(r"^\W*Error\W*$\n(.*)\n", re.MULTILINE)
"""How a word that no command has is told: in a frame."""


def require_can_begin(words: Sequence[str]) -> None:
    """Refuse a training command that would be refused as it began.

    Args:
        words: What stands behind `racecraft`.

    Raises:
        SettingError: It is refused, in the command's own words.
    """
    if message := _refusal(words, {}):
        raise SettingError(message)


def require_understood(words: Sequence[str], parameters: Mapping[str, Parameter]) -> None:
    """Refuse a search in which no trial could be begun.

    Args:
        words: The training command.
        parameters: What is varied.

    Raises:
        SettingError: A name that is no setting, or whatever else the command refuses, in the command's own words.
    """
    corners = [{name: _ends(one)[at] for name, one in parameters.items()} for at in (0, 1)]
    message = _refusal(words, corners[0])
    if message and _refusal(words, corners[1]):
        raise SettingError("no trial could be begun: {letter}", letter=message)


def _ends(parameter: Parameter) -> tuple[Any, Any]:
    if isinstance(parameter, CategoricalParameter):
        return parameter.values[0], parameter.values[-1]
    return parameter.min_value, parameter.max_value


def _refusal(words: Sequence[str], values: Mapping[str, Any]) -> str:
    """Return what a command refuses some values with; "" where it does not, or ends otherwise."""
    sets = [f"--set={name}={as_text(value)}" for name, value in values.items()]
    planned = subprocess.run(
        [sys.executable, "-m", "racecraft", *words, *sets],
        env={**os.environ, PLAN_ONLY: "1"}, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if not planned.returncode:
        return ""
    _, sign, message = planned.stderr.rpartition(ERROR_PREFIX)
    framed = _BOX.search(planned.stderr)
    return message.strip() if sign else framed[1].strip(" \u2502") if framed else ""
