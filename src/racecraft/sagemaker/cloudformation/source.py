"""The text of a template as plain values, with the line of each. Begin with `read_source`.

Scalars stay words, as CloudFormation compares them: `2012-10-17` is no date, `010` no number, and whatever YAML calls
true is "true". A short tag becomes its long form (`!GetAtt A.B` → {"Fn::GetAtt": ["A", "B"]}). JSON is read, too.

Refused as CloudFormation refuses it: aliases, merges, a key that stands twice, foreign tags. So a text cannot grow
while it is read, and nothing in it can make an object.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from racecraft.contract.errors import InputFileError, nearest
from racecraft.contract.message import Message
from racecraft.formats.user_file import read_regular

At = tuple[str, ...]
"""Where something stands: keys and list places from the top."""

SHORT_TAGS = (
    "Ref", "Condition", "And", "Base64", "Cidr", "Equals", "FindInMap", "GetAtt", "GetAZs", "If", "ImportValue", "Join",
    "Length", "Not", "Or", "Select", "Split", "Sub", "ToJsonString", "Transform",
)  # fmt: skip
YAML = "tag:yaml.org,2002:"
PLAIN_TAGS = ("map", "seq", "str", "null", "bool", "int", "float", "timestamp")
BARE = ("Ref", "Condition")
"""Those whose long form has no "Fn::"."""
MAX_SOURCE_CHARACTERS = 1_048_576
"""CloudFormation's own limit for a template."""
MAX_LEVELS = 60
_TRUE = ("true", "yes", "on")


class TemplateError(InputFileError):
    """A CloudFormation template cannot be used."""


@dataclass
class Source:
    """A template's values and where they stand."""

    path: Path
    values: Any = None
    lines: dict[At, int] = field(default_factory=dict)

    def line(self, at: At) -> int | None:
        """Return the line of a place, or of the nearest one above it that has a line."""
        for length in range(len(at), 0, -1):
            if at[:length] in self.lines:
                return self.lines[at[:length]]
        return None

    def refuse(self, at: At, found: str | Message, expected: str | Message, hint: str | Message = "") -> NoReturn:
        """Raise the error about a place.

        Raises:
            TemplateError: Always.
        """
        raise TemplateError(self.path, found, expected, hint, line=self.line(at), key=".".join(at) or None)


def read_source(path: str | Path) -> Source:
    """Read a template's text.

    Raises:
        TemplateError: It cannot be read, is no YAML, or says what CloudFormation does not allow.
    """
    import yaml  # type: ignore[import-untyped,unused-ignore]

    source = Source(Path(path))
    text = _text(source)
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as cause:
        mark = getattr(cause, "problem_mark", None)
        raise TemplateError(
            path,
            Message("not YAML: {problem}", problem=getattr(cause, "problem", None) or type(cause).__name__),
            "a CloudFormation template",
            line=None if mark is None else mark.line + 1,
        ) from cause
    source.values = None if node is None else _Values(source).of(node, ())
    return source


def _text(source: Source) -> str:
    try:
        text = read_regular(source.path).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as cause:
        reason = getattr(cause, "strerror", None) or cause
        raise TemplateError(
            source.path, Message("cannot be read ({reason})", reason=reason), "a CloudFormation template"
        ) from cause
    if len(text) > MAX_SOURCE_CHARACTERS:
        source.refuse(
            (),
            Message("{count} letters", count=len(text)),
            Message(
                "a template of at most {most_letters}, as CloudFormation takes it", most_letters=MAX_SOURCE_CHARACTERS
            ),
        )
    return text.replace("\t", " ") if text.lstrip().startswith("{") else text


class _Values:
    """Turns YAML's nodes into values, and writes down where each stands."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._seen: set[int] = set()

    def of(self, node: Any, at: At) -> Any:
        self._source.lines.setdefault(at, node.start_mark.line + 1)
        if id(node) in self._seen:
            self._source.refuse(at, "an alias (*…)", "the value itself: CloudFormation knows no aliases")
        if len(at) > MAX_LEVELS:
            self._source.refuse(at, Message("more than {most_levels} levels", most_levels=MAX_LEVELS), "a template")
        self._seen.add(id(node))
        tag = str(node.tag)
        if tag.removeprefix(YAML) in PLAIN_TAGS:
            return self._plain(node, tag.removeprefix(YAML), at)
        name = tag.removeprefix("!")
        if name not in SHORT_TAGS:
            self._source.refuse(
                at, Message("the tag {tag}", tag=tag), "a function of CloudFormation", nearest(name, SHORT_TAGS)
            )
        long = name if name in BARE else f"Fn::{name}"
        self._source.lines.setdefault((*at, long), node.start_mark.line + 1)
        inside = self._plain(node, "", (*at, long))
        if name == "GetAtt" and isinstance(inside, str):
            inside = inside.split(".", 1)
        return {long: inside}

    def _plain(self, node: Any, kind: str, at: At) -> Any:
        if node.id == "mapping":
            return self._mapping(node, at)
        if node.id == "sequence":
            return [self.of(part, (*at, str(place))) for place, part in enumerate(node.value)]
        if kind == "null":
            return None
        if kind == "bool" and not node.style:
            return "true" if node.value.lower() in _TRUE else "false"
        return str(node.value)

    def _mapping(self, node: Any, at: At) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, part in node.value:
            if key.id != "scalar" or str(key.tag) == "tag:yaml.org,2002:merge":
                self._source.lines[at] = key.start_mark.line + 1
                self._source.refuse(at, "a key that is no word", "a plain key: CloudFormation knows no merges")
            here = (*at, str(key.value))
            first = self._source.lines.get(here)
            self._source.lines[here] = key.start_mark.line + 1
            if str(key.value) in found:
                self._source.refuse(
                    here, Message("the key stands twice (first in line {first})", first=first), "each key once"
                )
            found[str(key.value)] = self.of(part, here)
        return found
