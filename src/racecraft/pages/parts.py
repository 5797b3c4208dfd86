"""Parts of a page that is one file, as functions: what templates/parts.html writes, for pages that are composed.

    write_file(path, "Why it fails", [heading("Turn 1"), card(paragraph("It brakes late."), table(…))])

Every function takes plain text, which it escapes, or ready parts (`Markup`) that others of these made.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

from markupsafe import Markup

from racecraft.pages.chart import Chart
from racecraft.pages.render import environment, render_file


class Heading(str):
    """A heading between the parts of a page; the page's list of contents names it."""

    __slots__ = ()


class Bar(float):
    """A share, 0 to 1, that a table draws as a bar."""

    __slots__ = ()


def page(title: str, pieces: Iterable[Heading | Markup], about: str = "", tab: str = "", **more: Any) -> str:
    """Return a whole page that is one file and fetches nothing.

    Args:
        title: Its first heading.
        pieces: Parts in order; those behind a `Heading` are a section of their own.
        about: A quiet line below the title.
        tab: What the browser's tab says; "": the title.
        more: Further data of the template, such as `modules` and `styles`.
    """
    sections: list[dict[str, Any]] = [{"heading": "", "body": []}]
    for piece in pieces:
        if isinstance(piece, Heading):
            sections.append({"heading": str(piece), "body": []})
        else:
            sections[-1]["body"].append(piece)
    return render_file("page.html", title=title, about=about, tab=tab or title, sections=sections, **more)


def heading(text: str) -> Heading:
    """Return a heading that begins a section."""
    return Heading(text)


def paragraph(text: object, kind: str = "") -> Markup:
    """Return a paragraph; kind: "" or "quiet" or "strong"."""
    return _part("paragraph", text, kind)


def card(*pieces: object, head: str = "", kind: str = "") -> Markup:
    """Return parts on a card, under a small heading where there is one."""
    return _part("card_of", pieces, head, kind)


def grid(*pieces: Markup) -> Markup:
    """Return cards side by side where there is room."""
    return _part("grid_of", pieces)


def details(summary: str, *pieces: object) -> Markup:
    """Return a card that opens when asked."""
    return _part("details_of", summary, pieces)


def tiles(facts: Iterable[tuple[str, str]]) -> Markup:
    """Return the figures one reads first: (number with unit, what it is)."""
    return _part("stat_strip", list(facts))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[object]], numbers: Sequence[int] = (), caption: str = ""
) -> Markup:
    """Return a table; columns whose index is in `numbers` stand to the right, a cell that is a `Bar` is drawn."""
    table_rows = [list(row) for row in rows]
    shares = sorted({k for row in table_rows for k, cell in enumerate(row) if isinstance(cell, Bar)})
    return _part("table", list(heads), table_rows, list(numbers), caption, shares)


def terms(rows: Iterable[tuple[str, str, str]]) -> Markup:
    """Return names with their value and, below, what they mean: what a table of sentences is on a narrow screen."""
    return _part("terms", list(rows))


def bullets(lines: Iterable[object], kind: str = "") -> Markup:
    """Return a list; kind: "" or "code"."""
    return _part("bullets", list(lines), kind)


def commands(lines: Iterable[str]) -> Markup:
    """Return commands as they are typed, a line each."""
    return _part("commands", list(lines))


def named(name: str, piece: Markup) -> Markup:
    """Return a part that a module or a test finds by `[data-plot="name"]`."""
    return _part("named", name, piece)


def wide(piece: Markup, words: str) -> Markup:
    """Return a part whose pictures keep a width at which they can be read; a narrow screen pushes them sideways."""
    return _part("wide", piece, words)


def source(text: str) -> Markup:
    """Return a program's text as it is written."""
    return _part("source", text)


def chart(shown: Chart) -> Markup:
    """Return a chart that the reader can zoom into, with its table."""
    return _part("chart", shown.shown())


def picture(address: str, words: str) -> Markup:
    """Return a picture; `words` say what it shows to those who cannot see it."""
    return _part("picture", address, words)


def film(address: str, words: str, poster: str = "") -> Markup:
    """Return a film; `poster` is the address of its first picture."""
    return _part("film", address, words, poster)


def _part(name: str, *values: Any) -> Markup:
    return Markup(str(getattr(_macros(), name)(*values)).strip())


@cache
def _macros() -> Any:
    return environment(inline=True).get_template("parts.html").module
