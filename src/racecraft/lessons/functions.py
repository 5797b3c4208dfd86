"""A pupil's own function, run in a process that can compute and nothing else. Begin with `call_function`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from racecraft.isolation.channel import from_head, to_head
from racecraft.isolation.process import CodeProcess, EndedError
from racecraft.lessons.checking import AnswerError

SECONDS = 10.0


def call_function(code: str, name: str, calls: Sequence[Sequence[Any]]) -> list[Any]:
    """Return what a function gives for each call.

    Args:
        code: Python that defines it.
        name: Of the function.
        calls: Arguments of each call, as JSON holds them.

    Raises:
        AnswerError: The code does not run, fails or does not end; names the line.
    """
    process = CodeProcess("racecraft.lessons.function_worker")
    try:
        reply, body = process.ask(b"", to_head({"code": code, "name": name, "calls": calls}), SECONDS)
    except EndedError as error:
        found = "did not end" if error.was_late else error.found
        raise AnswerError(
            "Your code {found}; expected an answer within {seconds:g} s. Is there a loop without an end?",
            found=found, seconds=SECONDS,
        ) from None  # fmt: skip
    finally:
        process.close()
    if "error" in reply:
        raise AnswerError("Line {line}: {error}", line=reply["line"], error=str(reply["error"])[:300])
    return list(from_head(body).get("values", []))


def call_for_numbers(code: str, name: str, calls: Sequence[Sequence[Any]]) -> list[float] | None:
    """As `call_function`; None where it gives anything but finite numbers."""
    found = call_function(code, name, calls)
    return found if all(map(is_number, found)) else None


def is_number(value: object) -> bool:
    """Tell whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
