"""One page of a list, by the key of its rows and not by their number. Begin with `one_page`.

A place in a list is a row's key, so that rows which come and go meanwhile neither repeat nor hide another.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar
from urllib.parse import urlencode

Row = TypeVar("Row")
Key = tuple[Any, str]
"""What rows are sorted by, smaller first, and a name that decides between equals."""
PAGE = 50
"""Rows on one page of a list."""


@dataclass(frozen=True)
class ListPage(Generic[Row]):
    """Some rows, and the addresses of the pages before and behind them; "": there is none."""

    rows: list[Row]
    before: str
    behind: str

    @property
    def links(self) -> dict[str, str]:
        """Return both addresses, as `pieces.pages` takes them."""
        return {"before": self.before, "behind": self.behind}


def one_page(
    path: str,
    query: Mapping[str, str],
    rows_beyond: Callable[[Key | None, bool, int], Sequence[Row]],
    key_of: Callable[[Row], Key],
    kind: type = float,
) -> ListPage[Row]:
    """Return the rows behind the place `after` of an address, or before its place `before`.

    Args:
        path: The address of the list, without its words.
        query: Its words.
        rows_beyond: Returns so many rows beyond a key, or from the end of the list where that is None; backwards, the
            nearest first, where the second argument says so.
        key_of: Returns the key of a row.
        kind: Of the first part of a key: float or str.
    """
    is_back = bool(query.get("before"))
    at = _place(query.get("before") or query.get("after", ""), kind)
    rows = rows_beyond(at, is_back, PAGE + 1)
    is_more, shown = len(rows) > PAGE, list(rows[:PAGE])
    if is_back:
        shown.reverse()

    def address(row: Row, word: str) -> str:
        return list_address(path, query, **{"after": "", "before": "", word: json.dumps(key_of(row))})

    has_before, has_behind = bool(is_more if is_back else at), bool(at if is_back else is_more)
    return ListPage(
        shown,
        address(shown[0], "before") if shown and has_before else "",
        address(shown[-1], "after") if shown and has_behind else "",
    )


def page_of(
    path: str, query: Mapping[str, str], rows: Sequence[Row], key_of: Callable[[Row], Key], kind: type = float
) -> ListPage[Row]:
    """Return a page of rows that are in memory, in any order; arguments as of `one_page`."""

    def rows_beyond(at: Key | None, is_back: bool, most: int) -> Sequence[Row]:
        beyond = [row for row in rows if at is None or (key_of(row) < at if is_back else key_of(row) > at)]
        return sorted(beyond, key=key_of, reverse=is_back)[:most]

    return one_page(path, query, rows_beyond, key_of, kind)


def list_address(path: str, query: Mapping[str, str], **changes: str) -> str:
    """Return the address of a list with some of its words changed; "" takes one out."""
    words = {name: value for name, value in {**query, **changes}.items() if value}
    return f"{path}?{urlencode(words)}" if words else path


def _place(text: str, kind: type) -> Key | None:
    """Return the key, its first part of this kind, that an address names; None: it names none."""
    with contextlib.suppress(ValueError, TypeError, OverflowError):
        value, name = json.loads(text[:400])
        if isinstance(value, str) == (kind is str) and isinstance(name, str):
            return kind(value), name
    return None
