"""Many invitations from a CSV file with the columns name and role. Begin with `read_invitations`."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from racecraft.accounts.people import Person, Role, legal_name, name_key, role_named
from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.contract.message import Message

MAX_ROWS, MAX_BYTES = 1000, 200_000


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the file."""

    line: int
    """Counted from 1, the heading included."""
    name: str
    role: Role = Role.RACER
    wrong: str = ""
    """Why nobody is invited by it; "": somebody is."""


def read_invitations(path: Path, text: str, known: Iterable[Person]) -> list[Row]:
    """Return the lines of a file, each with what is wrong with it.

    Args:
        path: For messages.
        text: Its contents; columns are separated by commas, semicolons or tabs. `role` may be left out: racer.
        known: The people there are.

    Raises:
        InputFileError: It is no such file.
    """
    if len(text) > MAX_BYTES:
        raise InputFileError(path, Message("{count:,} characters", count=len(text)), f"at most {MAX_BYTES:,}")
    text = text.removeprefix("\ufeff")
    heading = text.partition("\n")[0]
    separator = max(",;\t", key=heading.count)
    try:
        lines = list(csv.reader(io.StringIO(text), delimiter=separator, strict=True))
    except csv.Error as error:
        raise InputFileError(path, f"no CSV ({error})", "columns name and role, one person a line") from error
    columns = [cell.strip().casefold() for cell in lines[0]] if lines else []
    if "name" not in columns:
        found = Message("the heading {heading!r}", heading=heading[:80])
        raise InputFileError(path, found, "a heading with the column name and, if wanted, role", line=1)
    if len(lines) > MAX_ROWS + 1:
        raise InputFileError(path, Message("{count} people", count=len(lines) - 1), f"at most {MAX_ROWS}")
    taken = {name_key(person.name): "there is a person of that name" for person in known} | {"owner": "a name of ours"}
    rows = []
    for number, cells in enumerate(lines[1:], 2):
        if any(cell.strip() for cell in cells):
            rows.append(_row(number, dict(zip(columns, cells, strict=False)), taken))
            taken.setdefault(name_key(rows[-1].name), f"line {number} has that name")
    return rows


def _row(number: int, cells: dict[str, str], taken: dict[str, str]) -> Row:
    name = cells.get("name", "").strip()
    try:
        name, role = legal_name(name), role_named(cells.get("role", "").strip() or Role.RACER)
    except UserInputError as error:
        return Row(line=number, name=name, wrong=str(error))
    return Row(line=number, name=name, role=role, wrong=taken.get(name_key(name), ""))
