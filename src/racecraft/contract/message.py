"""A sentence as data: an English template and named fields. Its text is made where it is shown. Begin with `Message`.

The template is what a catalogue of another language knows it by (`i18n/`); the fields are what a program reads.
"""

from __future__ import annotations

import functools
import gettext
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

CATALOGUES = Path(__file__).resolve().parents[1] / "i18n"
"""Holds LANGUAGE/LC_MESSAGES/racecraft.mo."""
MAX_SHOWN_CHARACTERS = 300
"""Of what stands in a user's file; a value may be as long as the file."""
MAX_FIELD_CHARACTERS = 4000
"""Of any other field: a list of names is longer than a value."""


class Message:
    """One or more sentences, with what varies in them as fields.

    >>> message = Message("{path}: {count} rows; expected {least} or more.", path="laps.csv", count=1, least=2)
    >>> print(message)
    laps.csv: 1 rows; expected 2 or more.
    >>> message.fields["count"]
    1

    Args:
        template: As `str.format` takes it. Without fields it is the text itself, braces and all.
        fields: What stands in the template, by name.
    """

    __slots__ = ("fields", "template")

    def __init__(self, template: str, /, **fields: Any) -> None:
        self.template = template
        self.fields: Mapping[str, Any] = fields

    def __str__(self) -> str:
        translated = translate(self.template)
        if not self.fields:
            return translated
        return translated.format(**{name: _limited(value) for name, value in self.fields.items()})

    def __format__(self, spec: str) -> str:
        return format(str(self), spec)

    def __eq__(self, other: object) -> bool:
        return str(self) == str(other) if isinstance(other, Message | str) else NotImplemented

    def __hash__(self) -> int:
        return hash(str(self))

    def __bool__(self) -> bool:
        return bool(self.template)

    def __reduce__(self) -> tuple[Callable[..., Message], tuple[Any, ...]]:
        return _rebuilt, (self.template, dict(self.fields))

    def as_data(self) -> dict[str, Any]:
        """Return text, template and fields as JSON takes them."""
        return {
            "message": str(self), "template": self.template,
            "fields": {name: plain(value) for name, value in self.fields.items()},
        }  # fmt: skip


def translate(text: str) -> str:
    """Return a text in the user's language, by LANGUAGE, LC_ALL, LC_MESSAGES or LANG; English where none is known."""
    return _catalogue().gettext(text) if text else ""


def language() -> str:
    """Return the language that `translate` gives, as HTML names it; "en" where no catalogue is known."""
    found = gettext.find("racecraft", CATALOGUES)
    return Path(found).parents[1].name.replace("_", "-") if found else "en"


def shortened(text: str, most: int = MAX_SHOWN_CHARACTERS) -> str:
    r"""Return a text with its middle left out where it is long, and with what no terminal can show escaped.

    >>> shortened("a" * 1000, 9), shortened("half " + chr(0xD83D))
    ('aaaa…aaaa', 'half \\ud83d')
    """
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-(most // 2) :]}"
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def plain(value: Any) -> Any:
    """Return a value as JSON takes it: what JSON has no word for becomes its text, and what is no number null.

    >>> plain({"path": Path("a"), "rows": (1, float("nan"))})
    {'path': 'a', 'rows': [1, None]}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value if isinstance(value, str | int | None) else str(value)


@functools.cache
def _catalogue() -> gettext.NullTranslations:
    return gettext.translation("racecraft", CATALOGUES, fallback=True)


def _rebuilt(template: str, fields: Mapping[str, Any]) -> Message:
    return Message(template, **fields)


def _limited(value: Any) -> Any:
    if isinstance(value, int | float | Message):
        return value
    text = str(value)
    return (
        shortened(text, MAX_FIELD_CHARACTERS) if isinstance(value, str) or len(text) > MAX_FIELD_CHARACTERS else value
    )


def figure(value: float) -> str:
    """Return a number as people write it: four figures, or whole with separators from 1,000 on.

    >>> figure(61.0), figure(0.012345), figure(19964.2)
    ('61', '0.01235', '19,964')
    """
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def ends(low: float, high: float) -> tuple[str, str]:
    """Return both ends of a range with three figures; an end of less than a thousandth of the other one is 0.

    >>> ends(-3.5e-07, 32.1), ends(0.001, 4123.4)
    (('0', '32.1'), ('0', '4,123'))
    """
    least = 1e-3 * max(abs(low), abs(high))
    seen = [value if abs(value) > least else 0.0 for value in (low, high)]
    first, last = (figure(value) if abs(value) >= 1000 else f"{value:.3g}" for value in seen)
    return first, last
