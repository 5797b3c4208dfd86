"""Two texts of one origin, side by side and as one: what a form shows where somebody else was quicker."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher


def both_texts(mine: str, theirs: str) -> str:
    r"""Return one text with the lines of both; where they differ, mine stand before theirs.

    >>> both_texts("a\nmine\nc", "a\ntheirs\nc")
    'a\nmine\ntheirs\nc'
    """
    left, right = mine.splitlines(), theirs.splitlines()
    lines: list[str] = []
    for what, i1, i2, j1, j2 in _steps(left, right):
        lines += left[i1:i2] if what == "equal" else [*left[i1:i2], *right[j1:j2]]
    return "\n".join(lines)


def side_by_side(mine: str, theirs: str) -> list[tuple[str, str, bool]]:
    """Return both texts line by line: (mine, theirs, whether they differ); a line that one lacks is ""."""
    left, right = mine.splitlines(), theirs.splitlines()
    rows = []
    for what, i1, i2, j1, j2 in _steps(left, right):
        for k in range(max(i2 - i1, j2 - j1)):
            pair = (left[i1 + k] if i1 + k < i2 else "", right[j1 + k] if j1 + k < j2 else "")
            rows.append((*pair, what != "equal"))
    return rows


def _steps(left: Sequence[str], right: Sequence[str]) -> Sequence[tuple[str, int, int, int, int]]:
    return SequenceMatcher(None, left, right, autojunk=False).get_opcodes()
