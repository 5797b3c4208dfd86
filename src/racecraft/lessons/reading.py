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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
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
READ_BY_PEOPLE = (
    "ask", "hint", "worked", "why", "when", "label", "heads", "option", "number", "choice", "code", "model", "answer",
)  # fmt: skip
"""Keys whose values are sentences."""


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
    tokens = _parser().parse(text)
    front = {entry.keys[0]: entry.value for token in tokens if token.type == "front_matter"
             for entry in _entries(token, path)}  # fmt: skip
    number, blocks = front.get("number", ""), list(_blocks(tokens, path, front.get("number", "")))
    missing = {"id", "number", "title", "goal", "minutes", "path"} - front.keys()
    if missing:
        raise InputFileError(
            path, f"front matter without {', '.join(sorted(missing))}", "id, number, title, goal, minutes and path"
        )
    return Lesson(
        id=front["id"],
        number=number,
        title=translate(front["title"]),
        goal=translate(front["goal"]),
        minutes=int(front["minutes"]),
        path=front["path"],
        sources=front.get("sources", ""),
        words=tuple(word.strip() for word in front.get("words", "").split(",") if word.strip()),
        needs=translate(front.get("needs", "")),
        blocks=tuple(blocks),
    )


def messages(text: str, path: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of everything in a lesson that is translated."""
    for token in _parser().parse(text):
        line = token.map[0] + 1 if token.map else 1
        if token.type == "inline":
            yield line, token.content
        elif token.type == "front_matter":
            yield from ((e.line, e.value) for e in _entries(token, path) if e.keys[0] in ("title", "goal", "needs"))
        elif token.type == "colon_fence":
            kind, title = _directive(token, path)
            if kind == "teacher":
                yield from ((line + at, found) for at, found in messages(token.content, path))
            elif kind == "slide":
                yield line, title
            else:
                yield from (
                    (
                        entry.line,
                        _label(entry) if entry.keys[0] in ("number", "choice", "code", "model") else entry.value,
                    )
                    for entry in _entries(token, path)
                    if (entry.keys[1] if entry.keys[0] == "later" else entry.keys[0]) in READ_BY_PEOPLE
                )


@cache
def _parser() -> MarkdownIt:
    return MarkdownIt("commonmark").enable("table").use(front_matter_plugin).use(colon_fence_plugin)


def _blocks(tokens: Sequence[Token], path: str, number: str) -> Iterator[Block]:
    """Yield a lesson's blocks; what stands between directives is prose."""
    prose: list[Token] = []
    count = 0
    for token in tokens:
        if token.type == "colon_fence":
            if prose:
                yield Prose(_html(prose))
                prose = []
            kind, name = _directive(token, path)
            count += kind == "exercise"
            yield _block(kind, name, token, path, f"{number}.{count}")
        elif token.type != "front_matter":
            prose.append(token)
    if prose:
        yield Prose(_html(prose))


def _block(kind: str, name: str, token: Token, path: str, number: str) -> Block:
    if kind == "slide":
        return Slide(translate(name))
    if kind == "teacher":
        return TeacherNote(_html(_parser().parse(token.content)))
    entries = _entries(token, path)
    by_key = {entry.keys[0]: entry.value for entry in entries}
    if kind == "figure":
        told = {key: translate(value) if key in READ_BY_PEOPLE else _plain(value) for key, value in by_key.items()}
        label = told.pop("label", "")
        return Figure(name, told.pop("name", name), told, label)
    if kind == "recall":
        return Recall(translate(by_key["ask"]), translate(by_key["answer"]))
    if kind == "exercise":
        return _exercise(name, entries, path, token, number)
    raise InputFileError(path, f"the directive {kind}", "figure, exercise, recall, slide or teacher", line=_line(token))


def _exercise(name: str, entries: Sequence[Entry], path: str, token: Token, number: str) -> Exercise:
    fields: list[Field] = []
    cases: dict[str, str] = {}
    plain: dict[str, str] = {}
    for entry in entries:
        keys = entry.keys[1:] if entry.keys[0] == "later" else entry.keys
        if keys[0] == "when":
            cases[keys[1]] = translate(entry.value)
        elif keys[0] == "option":
            of, value = keys[1:]
            found = next(k for k, field in enumerate(fields) if field.name == of)
            fields[found].options[value] = translate(entry.value)  # type: ignore[index]
        elif keys[0] in ("number", "choice", "code", "take", "model"):
            fields.append(_field(Entry(keys, entry.value, entry.line), path, later=keys is not entry.keys))
        else:
            plain[keys[0]] = entry.value
    if missing := {"check", "ask"} - plain.keys():
        raise InputFileError(
            path, f"the exercise {name} without {', '.join(missing)}", "check and ask", line=_line(token)
        )
    check, *words = plain["check"].split()
    return Exercise(
        id=name,
        number=number,
        kind="prediction" if plain.get("kind") == "prediction" else "task",
        check=check,
        arguments={key: _plain(value) for key, _, value in (word.partition("=") for word in words)},
        ask=translate(plain["ask"]),
        fields=tuple(fields),
        hint=translate(plain.get("hint", "")),
        worked=translate(plain.get("worked", "")),
        why=translate(plain.get("why", "")),
        cases=cases,
    )


def _field(entry: Entry, path: str, later: bool) -> Field:
    kind, name = entry.keys[:2]
    if kind == "take":
        return Field(name, "take", figure=entry.value)
    label = translate(_label(entry))
    if kind == "choice":
        return Field(name, "choice", label, later=later)
    if kind == "model":
        return Field(name, "model", label)
    if kind == "code":
        return Field(name, "code", label, code=entry.value.partition("\n")[2] + "\n")
    found = _RANGE.match(entry.value.split(" ", 1)[0])
    if found is None:
        raise InputFileError(path, f"number {name} without a range", "number NAME: LOW..HIGH Label", line=entry.line)
    return Field(name, "number", label, low=float(found[1]), high=float(found[2]), later=later)


def _label(entry: Entry) -> str:
    """Return what people read of a field: without the range of a number and the code."""
    if "number" in entry.keys[:2]:
        return entry.value.partition(" ")[2]
    return entry.value.partition("\n")[0]


def _entries(token: Token, path: str) -> list[Entry]:
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
            raise InputFileError(path, f"the line {line[:60]!r}", "key: value, or two spaces to go on", line=at)
        found.append(Entry(tuple(entry[1].split()), entry[2] or "", at))
    return [Entry(one.keys, one.value.rstrip(), one.line) for one in found]


def _directive(token: Token, path: str) -> tuple[str, str]:
    found = _NAME.match(token.info.strip())
    if found is None:
        raise InputFileError(path, f"the fence {token.info!r}", ":::{name} id", line=_line(token))
    return found[1], found[2].strip()


def _html(tokens: Sequence[Token]) -> Markup:
    """Return prose as HTML, each paragraph in the user's language."""
    parser = _parser()
    for token in tokens:
        if token.type == "inline" and (text := translate(token.content)) != token.content:
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
