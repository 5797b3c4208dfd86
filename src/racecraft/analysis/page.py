"""Parts of a self-contained web page: nothing is fetched, text is escaped, light and dark follow the reader's wish."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from racecraft.pages.colours import BLUE, INK, PAPER, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """
:root { color-scheme: light dark; --ground: #f5f6f7; --card: #ffffff; --ink: #1d2327; --quiet: #5c6770;
  --line: #dfe3e6; --bar: #0072b2; --slot: #e9edf0; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #11161b; --card: #1a2127; --ink: #edf0f2; --quiet: #9aa5ae; --line: #2c353c; --bar: #56b4e9;
    --slot: #2a333a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, sans-serif;
  -webkit-text-size-adjust: 100%; }
main { max-width: 1060px; margin: 0 auto; padding: 28px 16px 64px; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 4px; }
h2 { font-size: 1.2rem; margin: 40px 0 12px; }
p { margin: 8px 0; max-width: 46em; }
.quiet, small { color: var(--quiet); }
.tiles { display: grid; gap: 12px; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); margin: 22px 0; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 14px 16px; min-width: 0; }
.tile b { display: block; font-size: 1.5rem; line-height: 1.25; font-variant-numeric: tabular-nums; }
.tile span { color: var(--quiet); font-size: .9rem; }
.grid { display: grid; gap: 12px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); }
.card + .card, .card + .grid, .grid + .card { margin-top: 12px; }
.grid .card, .tiles .card { margin-top: 0; }
svg { display: block; width: 100%; height: auto; overflow: visible; }
.large svg { max-width: 640px; margin: 0 auto; }
img, video { display: block; width: 100%; height: auto; border-radius: 8px; background: #fff; }
video { max-width: 760px; background: #11161b; }
.scroll { overflow: auto; max-height: 620px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: .95rem; }
th { text-align: left; color: var(--quiet); font-weight: 500; position: sticky; top: 0; background: var(--card); }
th, td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td:last-child, th:last-child { padding-right: 0; }
td + td { overflow-wrap: anywhere; }
tr:last-child td { border-bottom: 0; }
dl { margin: 8px 0 0; font-size: .95rem; font-variant-numeric: tabular-nums; }
dt { margin-top: 8px; overflow-wrap: anywhere; }
dd { margin: 0; color: var(--quiet); max-width: 46em; }
.right { text-align: right; }
td.right, td.name { white-space: nowrap; }
.bar { background: var(--slot); border-radius: 3px; min-width: 40px; height: 1em; margin-top: .25em; }
.bar i { display: block; height: 100%; background: var(--bar); border-radius: 3px; }
td.wide { width: 40%; }
details > summary { cursor: pointer; padding: 4px 0; font-weight: 600; }
details .scroll { margin-top: 8px; }
pre { overflow: auto; max-height: 520px; margin: 8px 0 0; font-size: .9rem; line-height: 1.45; tab-size: 4; }
pre code { overflow-wrap: normal; }
code { font-family: ui-monospace, monospace; font-size: .92em; overflow-wrap: anywhere; }
"""


def page(title: str, parts: Iterable[str]) -> str:
    """Return a whole HTML document of ready parts."""
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escaped(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}\n</main>\n</body>\n"
        "</html>\n"
    )


def escaped(text: object) -> str:
    """Return text as it may stand in HTML.

    >>> escaped("a < b & 'c'")
    'a &lt; b &amp; &#x27;c&#x27;'
    """
    return html.escape(str(text))


def card(inside: str, kind: str = "") -> str:
    """Return ready HTML on a card."""
    return f'<div class="{f"card {kind}".strip()}">{inside}</div>'


def tiles(facts: Iterable[tuple[str, str]]) -> str:
    """Return the figures one reads first: (number with unit, what it is)."""
    each = (
        f'<div class="card tile"><b>{escaped(number)}</b><span>{escaped(name)}</span></div>' for number, name in facts
    )
    return f'<div class="tiles">{"".join(each)}</div>'


def table(heads: Sequence[str], rows: Iterable[Sequence[object]], numbers: Sequence[int] = ()) -> str:
    """Return a table; columns whose index is in `numbers` stand to the right. A cell that is a `Bar` is drawn."""

    def cell(kind: str, k: int, value: object) -> str:
        if isinstance(value, Bar):
            return f'<{kind} class="wide">{value}</{kind}>'
        place = ' class="right"' if k in numbers else ' class="name"' if k == 0 and numbers else ""
        return f"<{kind}{place}>{escaped(value)}</{kind}>"

    head = "".join(cell("th", k, name) for k, name in enumerate(heads))
    lines = "".join(f"<tr>{''.join(cell('td', k, value) for k, value in enumerate(row))}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table></div>'


class Bar(str):
    """A bar as long as a share, 0 to 1, for a table."""

    __slots__ = ()

    def __new__(cls, share: float) -> Bar:
        """Return the bar's HTML."""
        width = 100.0 * min(1.0, max(0.0, share))
        return super().__new__(cls, f'<div class="bar"><i style="width:{width:.1f}%"></i></div>')


def terms(rows: Iterable[tuple[str, str, str]]) -> str:
    """Return names with their value and, below, what they mean: what a table of sentences is on a narrow screen."""
    each = (
        f"<dt>{escaped(name)} <b>{escaped(value)}</b></dt><dd>{escaped(meaning)}</dd>" for name, value, meaning in rows
    )
    return f"<dl>{''.join(each)}</dl>"


def details(summary: str, inside: str) -> str:
    """Return a part that opens when asked."""
    return f'<div class="card"><details><summary>{escaped(summary)}</summary>{inside}</details></div>'


def drawing(figure: Figure, words: str) -> str:
    """Return a chart as inline SVG in the page's own colours; `words` say what it shows to those who cannot see it."""
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True)
    svg = out.getvalue()[out.getvalue().index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    opening, rest = svg.split(">", 1)
    box = re.search(r'viewBox="[^"]*"', opening)
    assert box is not None
    for colour, name in ((INK, "ink"), (QUIET, "quiet"), (PAPER, "card"), (BLUE, "bar")):
        rest = rest.replace(colour, f"var(--{name})")
    return f'<svg {box[0]} role="img" aria-label="{escaped(words)}">{rest}'


def film(data: bytes, words: str) -> str:
    """Return an MP4 as a <video> that carries its own bytes; `words` say what it shows."""
    bytes_ = base64.b64encode(data).decode()
    return (
        f'<video controls muted playsinline aria-label="{escaped(words)}" src="data:video/mp4;base64,{bytes_}"></video>'
    )


def source(text: str) -> str:
    """Return a program's text as it is written."""
    return f"<pre><code>{escaped(text)}</code></pre>"


def photograph(figure: Figure, words: str, dpi: int = 110) -> str:
    """Return a picture as an <img> that carries its own bytes."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi)
    data = base64.b64encode(out.getvalue()).decode()
    return f'<img alt="{escaped(words)}" src="data:image/png;base64,{data}">'


def duration(seconds: float) -> str:
    """Return a time as a person says it.

    >>> duration(7.2), duration(95), duration(3.5 * 3600)
    ('7.2 s', '1 min 35 s', '3 h 30 min')
    """
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds // 60)} min {int(seconds % 60)} s"
    return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60)} min"
