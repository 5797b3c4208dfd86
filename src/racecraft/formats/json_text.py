"""JSON as people write it by hand, and on which line each value stands.

`read_json` gives a `JsonDocument`: the value, and on demand the line of every key in it, so that an error message
can say where. A byte order mark is passed over; comments are read as if they were not there, with a note.
"""

from __future__ import annotations

import bisect
import functools
import json
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.user_file import read_user_text, typing_hint

MAX_SCANNED_CHARACTERS = 1 << 20
Step = str | int
"""One step into a document: a key of an object or a place in a list."""

_STRING_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|#[^\n]*|/\*.*?\*/', re.DOTALL)
_OTHER_COMMENTS = ("<!--", "--", ";", "%", "'''", "rem ", "REM ")
_SPACE = re.compile(r"\s*")
_SCALAR = re.compile(r'"(?:\\.|[^"\\])*"|[^\s,\]}]+')


@dataclass(frozen=True)
class JsonDocument:
    """A JSON file that was read."""

    path: Path
    value: Any
    """What `json.loads` makes of it."""
    text: str
    """The file's text, comments replaced by spaces."""
    notes: tuple[str, ...]
    """What is worth telling the user."""
    error: type[InputFileError]
    """What is raised about this file."""

    @functools.cached_property
    def lines(self) -> dict[tuple[Step, ...], int]:
        """Line of each value, counted from 1, by the steps that lead to it: ("action_space", 2, "speed").

        None of a text above MAX_SCANNED_CHARACTERS: nobody wrote it by hand, and to look takes seconds.
        """
        if len(self.text) > MAX_SCANNED_CHARACTERS:
            return {}
        try:
            return _Scan(self.text).lines
        except RecursionError:
            return {}

    def line_of(self, *steps: Step) -> int | None:
        """Return the line of the value the steps lead to, or of the nearest thing around it."""
        for length in range(len(steps), -1, -1):
            if steps[:length] in self.lines:
                return self.lines[steps[:length]]
        return None

    def error_at(
        self, *steps: Step, found: str | Message, expected: str | Message, hint: str | Message = ""
    ) -> InputFileError:
        """Return the error about the value the steps lead to, with its line and key."""
        key = key_text(*steps) or None
        return self.error(self.path, found, expected, hint, line=self.line_of(*steps), key=key)


def read_json(path: str | Path, error: type[InputFileError], kind: str) -> JsonDocument:
    """Read a JSON file.

    Args:
        path: The file.
        error: What to raise when it cannot be read.
        kind: What the file should be, for the message: "a JSON object with hyperparameters".

    Raises:
        InputFileError: Of the kind `error`: the file is missing, no text, empty, or no JSON; with line where known.
    """
    path = Path(path)
    text = read_user_text(path, error, kind)
    plain = _without_comments(text)
    notes = [] if plain == text else ["comments were passed over; take them out for AWS, which reads none"]
    twice: list[str] = []
    try:
        value = json.loads(plain, object_pairs_hook=lambda pairs: _as_dict(pairs, twice))
    except json.JSONDecodeError as wrong:
        comma = _trailing_comma(plain, wrong)
        line = wrong.lineno if comma is None else plain[:comma].count("\n") + 1
        found = Message("no valid JSON, {what_is_wrong}", what_is_wrong=_what_is_wrong(plain, wrong))
        raise error(path, found, kind, _what_to_do(plain, wrong), line=line) from None
    except (RecursionError, ValueError):
        raise error(path, "values nested too deeply, or a number too long, to be read", kind) from None
    notes += [f"'{key}' is given twice; the last one counts" for key in twice]
    return JsonDocument(path, value, plain, tuple(notes), error)


def parse_json(text: str | bytes) -> Any:
    """Return what JSON holds; whatever is wrong with it is a ValueError.

    >>> parse_json("[" * 100_000)
    Traceback (most recent call last):
    ValueError: values nested too deeply
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("values nested too deeply") from None


def as_number(value: Any) -> float | int | None:
    """Return the number a value holds, also when it is written as text; None where it holds none.

    >>> as_number("4.0"), as_number(3), as_number(True), as_number("fast")
    (4.0, 3, None, None)
    """
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return value
    if isinstance(value, str):
        try:
            return float(value.strip())
        except ValueError:
            return None
    return None


def kind_of(value: Any) -> str:
    """Return what a JSON value is, in words."""
    names = {dict: "an object", list: "a list", str: "a word", bool: "true or false", type(None): "nothing (null)"}
    return names.get(type(value), "a number")


def key_text(*steps: Step) -> str:
    """Return steps as a user reads them.

    >>> key_text("action_space", 2, "speed")
    'action_space[2].speed'
    """
    text = ""
    for step in steps:
        text += f"[{step}]" if isinstance(step, int) else ("." if text else "") + step
    return text


def _without_comments(text: str) -> str:
    """Return the text with comments replaced by spaces, so that every line keeps its number."""

    def blank(match: re.Match[str]) -> str:
        found = match.group()
        return found if found.startswith('"') else re.sub(r"[^\n]", " ", found)

    return _STRING_OR_COMMENT.sub(blank, text)


def _trailing_comma(text: str, wrong: json.JSONDecodeError) -> int | None:
    """Return where the comma stands that follows a last entry; None where that is not what is wrong.

    Python 3.13 points at the comma, earlier ones at the bracket behind it.
    """
    before = text[: wrong.pos + 1 if text[wrong.pos : wrong.pos + 1] == "," else wrong.pos].rstrip()
    behind = text[len(before) :].lstrip()
    return len(before) - 1 if before.endswith(",") and behind[:1] in ("}", "]") else None


def _what_is_wrong(text: str, wrong: json.JSONDecodeError) -> str:
    here = text[wrong.pos :].lstrip()
    if _trailing_comma(text, wrong) is not None:
        return "a comma stands after the last entry"
    if here[:1] == "'":
        return "quoted with ' where JSON wants \""
    if here[:1] in ("\u201c", "\u201d", "\u2018", "\u2019"):
        return f'the typographic quote {here[0]} where JSON wants "'
    if not here:
        return "it ends too early (a bracket or quote is not closed)"
    rest = here.partition("\n")[0][:40]
    return f"{wrong.msg[:1].lower()}{wrong.msg[1:]} at column {wrong.colno}, before {rest!r}"


def _what_to_do(text: str, wrong: json.JSONDecodeError) -> str:
    """Return a hint for what people write in JSON; empty where none fits."""
    mark = next((mark for mark in _OTHER_COMMENTS if text[wrong.pos :].lstrip().startswith(mark)), None)
    if mark is not None:
        return f"{mark} begins no comment here: JSON has none, and of others only //, # and /* */ are passed over."
    return typing_hint(text.split("\n")[wrong.lineno - 1])


def _as_dict(pairs: list[tuple[str, Any]], twice: list[str]) -> dict[str, Any]:
    """Return an object's entries; the keys that stand in it more than once are added to `twice`."""
    twice += [key for key, count in Counter(key for key, _ in pairs).items() if count > 1]
    return dict(pairs)


class _Scan:
    """One walk over valid JSON that notes on which line each value begins."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines: dict[tuple[Step, ...], int] = {}
        self._line_ends = [match.start() for match in re.finditer("\n", text)]
        self._value(0, ())

    def _value(self, at: int, steps: tuple[Step, ...]) -> int:
        """Note the value that begins at or after a place, and all inside; return where it ends."""
        at = self._after_space(at)
        self.lines[steps] = bisect.bisect_left(self._line_ends, at) + 1
        if self.text[at] not in "{[":
            return self._scalar(at)
        closing, number = ("}" if self.text[at] == "{" else "]"), 0
        at = self._after_space(at + 1)
        while self.text[at] != closing:
            step: Step = number
            if closing == "}":
                end = self._scalar(at)
                step = json.loads(self.text[at:end])
                at = self._after_space(end) + 1  # over the colon
            at = self._after_space(self._value(at, (*steps, step)))
            if self.text[at] == ",":
                at = self._after_space(at + 1)
            number += 1
        return at + 1

    def _scalar(self, at: int) -> int:
        match = _SCALAR.match(self.text, at)
        return match.end() if match else at + 1  # never reached in valid JSON; a walk goes on all the same

    def _after_space(self, at: int) -> int:
        match = _SPACE.match(self.text, at)
        return match.end() if match else at
