"""Traces that a spreadsheet saved, and text in UTF-16, as the plain text they were. Begin with `as_plain_text`.

Where the comma is the decimal point, Excel parts columns by semicolons; what it calls Unicode text is UTF-16 with tabs,
and so is a log that went through PowerShell's `>`. All of this can be undone without a guess: between such signs a
comma can only stand in a number. Numbers that carry signs for thousands as well are told row by row.
"""

from __future__ import annotations

import codecs
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from racecraft.worlds.deepracer.logs.archive import MemberFile
from racecraft.worlds.deepracer.logs.sources import Source

_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_SIGNS = {";": "semicolons", "\t": "tabs"}
_FEWEST_SIGNS = 5
"""A trace has many more columns, and no name of one holds such a sign."""
CURE = " (save it as `CSV (comma delimited)` where the decimal point is a point, to be sure)"


def as_plain_text(source: Source, head: bytes) -> tuple[Source, str]:
    """Return a file as comma-separated text in UTF-8, and what was done about it; the file itself where it is that.

    Lines keep their numbers.

    Args:
        source: A trace or a log.
        head: Its first bytes, the first line at least.
    """
    is_wide = head.startswith(_WIDE)
    encoding = "utf-16" if is_wide else "utf-8-sig"
    sign = _parting(head, encoding)
    if not is_wide and not sign:
        return source, ""
    text = _decoded(source.read(), encoding)
    notes = ["is UTF-16 text"] if is_wide else []
    if sign:
        notes.append(f"parts its columns by {_SIGNS[sign]}")
        if "," in text:
            notes.append("writes decimal commas")
        text = text.replace(",", ".").replace(sign, ",")
    file = source.file
    if isinstance(file, MemberFile):
        place = (file.archive, file.name)
    else:
        place = (Path(str(file)).parent, Path(str(file)).name)
    plain = replace(source, file=MemberFile(*place, text.encode()))
    by, hint = ("a spreadsheet", CURE) if sign else ("PowerShell", "")
    return plain, f"{' and '.join(notes)}, as {by} saves it; read as such{hint}"


def _decoded(data: bytes, encoding: str) -> str:
    return data.decode(encoding, errors="replace").replace("\r\n", "\n")


@lru_cache
def _parting(head: bytes, encoding: str) -> str:
    """Return the sign that parts the columns of a header; "" where it is the comma."""
    line = _decoded(head[: len(head) // 2 * 2], encoding).split("\n", 1)[0]
    return next((sign for sign in _SIGNS if line.count(sign) >= _FEWEST_SIGNS and "," not in line), "")
