"""A text becomes a lesson. Begin with `read_lesson`.

A text is CommonMark with front matter and fenced directives. The body of a directive is lines `key: value`; a line that
begins with two spaces continues the one before::

    :::{exercise} best-drive
    check: best_drive total=12.0
    ask: Drive the best episode.
    take drive: grid
    when left_road: The drive ended at a stop square after {total}.
    why: Six squares of 2.0; every other drive leaves the centre.
    :::

Every paragraph and every value that people read is one message of the catalogue (`messages`), translated where it
stands; names, numbers and code are not.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup
from mdit_py_plugins.colon_fence import colon_fence_plugin
from mdit_py_plugins.front_matter import front_matter_plugin

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import translate
from racecraft.lessons.lesson import Block, Exercise, Field, Figure, Lesson, Prose, Recall, Slide, TeacherNote

_NAME = re.compile(r"\{(\w+)\}\s*(.*)")
_ENTRY = re.compile(r"([a-z]+(?: [\w.-]+)*):(?: (.*))?$")
_RANGE = re.compile(r"(-?[\d.]+)\.\.(-?[\d.]+)$")


@dataclass(frozen=True)
class Entry:
    """One `key: value` of a directive."""

    keys: tuple[str, ...]
    value: str
    line: int


def read_lesson(text: str, path: str) -> Lesson:
    """Return the lesson that a text describes, in the user's language.

    Args:
        text: CommonMark with front matter.
        path: Of the file, for messages.

    Raises:
        InputFileError: The text is no lesson; names the line.
    """
    return _Reader(path, lambda _, sentence: translate(sentence)).lesson(text)


def messages(text: str, path: str) -> list[tuple[int, str]]:
    """Return line and text of everything in a lesson that is translated: what reading it asks to be translated."""
    found: list[tuple[int, str]] = []

    def keep(line: int, sentence: str) -> str:
        found.append((line, sentence))
        return sentence

    _Reader(path, keep).lesson(text)
    return found


@cache
def _parser() -> MarkdownIt:
    return MarkdownIt("commonmark").enable("table").use(front_matter_plugin).use(colon_fence_plugin)


class _Reader:
    """Reads one text.

    Args:
        path: Of the file, for messages.
        translated: Returns a sentence in the reader's language, given its line and text.
    """

    def __init__(self, path: str, translated: Callable[[int, str], str]) -> None:
        self._path, self._translated = path, translated

    def lesson(self, text: str) -> Lesson:
        tokens = _parser().parse(text)
        front = {one.keys[0]: one for token in tokens if token.type == "front_matter" for one in self._entries(token)}
        if missing := {"id", "number", "title", "goal", "minutes", "path"} - front.keys():
            raise InputFileError(
                self._path, f"front matter without {', '.join(sorted(missing))}",
                "id, number, title, goal, minutes and path",
            )  # fmt: skip
        plain, nothing = {name: one.value for name, one in front.items()}, Entry((), "", 1)
        return Lesson(
            id=plain["id"],
            number=plain["number"],
            title=self._said(front["title"]),
            goal=self._said(front["goal"]),
            minutes=int(plain["minutes"]),
            path=plain["path"],
            sources=plain.get("sources", ""),
            words=tuple(word.strip() for word in plain.get("words", "").split(",") if word.strip()),
            needs=self._said(front.get("needs", nothing)),
            blocks=tuple(self._blocks(tokens, plain["number"])),
        )

    def _said(self, entry: Entry) -> str:
        return self._translated(entry.line, entry.value) if entry.value else ""

    def _blocks(self, tokens: Sequence[Token], number: str) -> Iterator[Block]:
        """Yield a lesson's blocks; what stands between directives is prose."""
        count, prose_and_directives = 0, (token for token in tokens if token.type != "front_matter")
        for is_directive, group in groupby(prose_and_directives, lambda token: token.type == "colon_fence"):
            if not is_directive:
                yield Prose(self._html(list(group)))
                continue
            for token in group:
                kind, name = self._directive(token)
                count += kind == "exercise"
                yield self._block(kind, name, token, f"{number}.{count}")

    def _block(self, kind: str, name: str, token: Token, number: str) -> Block:
        if kind == "slide":
            return Slide(self._translated(_line(token), name))
        if kind == "teacher":
            return TeacherNote(self._html(_parser().parse(token.content), _line(token)))
        entries = self._entries(token)
        by_key = {entry.keys[0]: entry for entry in entries}
        if kind == "figure":
            told = {key: self._said(one) if key in ("label", "heads") else _plain(one.value)
                    for key, one in by_key.items()}  # fmt: skip
            label = told.pop("label", "")
            return Figure(name, told.pop("name", name), told, label)
        if kind == "recall":
            return Recall(self._said(by_key["ask"]), self._said(by_key["answer"]))
        if kind == "exercise":
            return self._exercise(name, entries, token, number)
        raise InputFileError(
            self._path, f"the directive {kind}", "figure, exercise, recall, slide or teacher", line=_line(token)
        )

    def _exercise(self, name: str, entries: Sequence[Entry], token: Token, number: str) -> Exercise:
        fields: dict[str, Field] = {}
        cases: dict[str, str] = {}
        plain: dict[str, Entry] = {}
        for entry in entries:
            keys = entry.keys[1:] if entry.keys[0] == "later" else entry.keys
            if keys[0] == "when":
                cases[keys[1]] = self._said(entry)
            elif keys[0] == "option":
                fields[keys[1]].options[keys[2]] = self._said(entry)  # type: ignore[index]
            elif keys[0] in ("number", "choice", "code", "take", "model"):
                fields[keys[1]] = self._field(keys[0], keys[1], entry, later=keys is not entry.keys)
            else:
                plain[keys[0]] = entry
        if missing := {"check", "ask"} - plain.keys():
            raise InputFileError(
                self._path, f"the exercise {name} without {', '.join(missing)}", "check and ask", line=_line(token)
            )
        check, *words = plain["check"].value.split()
        return Exercise(
            id=name,
            number=number,
            kind="prediction" if "kind" in plain and plain["kind"].value == "prediction" else "task",
            check=check,
            arguments={key: _plain(value) for key, _, value in (word.partition("=") for word in words)},
            fields=tuple(fields.values()),
            cases=cases,
            **{key: self._said(plain[key]) for key in ("ask", "hint", "worked", "why", "heads") if key in plain},
        )

    def _field(self, kind: str, name: str, entry: Entry, later: bool) -> Field:
        if kind == "take":
            return Field(name, "take", figure=entry.value)
        first, _, code = entry.value.partition("\n")
        span, _, rest = entry.value.partition(" ")
        label = self._translated(entry.line, rest if kind == "number" else first)
        if kind == "choice":
            return Field(name, "choice", label, options={}, later=later)
        if kind == "model":
            return Field(name, "model", label)
        if kind == "code":
            return Field(name, "code", label, code=code + "\n")
        found = _RANGE.match(span)
        if found is None:
            raise InputFileError(
                self._path, f"number {name} without a range", "number NAME: LOW..HIGH Label", line=entry.line
            )
        return Field(name, "number", label, low=float(found[1]), high=float(found[2]), later=later)

    def _entries(self, token: Token) -> list[Entry]:
        first = _line(token) + (token.type == "colon_fence")
        found: list[Entry] = []
        for at, line in enumerate(token.content.split("\n"), first):
            if line.startswith("  ") or not line.strip():
                if found:
                    last = found.pop()
                    is_code = last.keys[0] == "code"
                    more = f"\n{line[2:]}" if is_code else f" {line.strip()}" if line.strip() else ""
                    found.append(Entry(last.keys, last.value + more, last.line))
                continue
            entry = _ENTRY.match(line)
            if entry is None:
                raise InputFileError(
                    self._path, f"the line {line[:60]!r}", "key: value, or two spaces to go on", line=at
                )
            found.append(Entry(tuple(entry[1].split()), entry[2] or "", at))
        return [Entry(one.keys, one.value.rstrip(), one.line) for one in found]

    def _directive(self, token: Token) -> tuple[str, str]:
        found = _NAME.match(token.info.strip())
        if found is None:
            raise InputFileError(self._path, f"the fence {token.info!r}", ":::{name} id", line=_line(token))
        return found[1], found[2].strip()

    def _html(self, tokens: Sequence[Token], above: int = 0) -> Markup:
        """Return prose as HTML, each paragraph in the user's language; `above` are the lines before its first."""
        parser = _parser()
        for token in tokens:
            if token.type == "inline":
                text = self._translated(above + _line(token), token.content)
                if text != token.content:
                    token.children = parser.parseInline(text)[0].children
        return Markup(parser.renderer.render(list(tokens), parser.options, {}))


def _plain(value: str) -> Any:
    """Return a number where a word is one.

    >>> _plain("0.9"), _plain("7"), _plain("centre")
    (0.9, 7, 'centre')
    """
    for make in (int, float):
        try:
            return make(value)
        except ValueError:
            continue
    return value


def _line(token: Token) -> int:
    return token.map[0] + 1 if token.map else 1
