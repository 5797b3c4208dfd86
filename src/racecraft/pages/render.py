"""A page from a template and plain data. Begin with `render` (served) and `render_file` (one file to keep or send).

Text is escaped wherever it stands; ready HTML is a `markupsafe.Markup` that another template made. Undefined names are
errors. Inside a template:

    {{ style("parts.css") }}     the style, linked or inlined
    {% set modules = ["chart.js"] %}   in a template that extends `document.html`: its modules and what they import
    {{ data(value) }}            JSON for a module, in a script element that runs nothing; NaN becomes null
    {{ asset("logo.svg") }}      an address
    {{ _("Lessons") }}           a text in the reader's language; what modules say is written into #texts
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined, pass_context
from jinja2.runtime import Context
from markupsafe import Markup

from racecraft.contract.message import language, translate
from racecraft.pages.assets import asset, imported
from racecraft.pages.filters import WORDS
from racecraft.pages.plain_json import plain_json
from racecraft.pages.resources import read_resource


def render(template: str, **data: Any) -> str:
    """Return a page for a server; its styles and modules have addresses under /assets/.

    Args:
        template: "shell.html", or "package/file.html" for one of another package.
        data: What the template names.

    Raises:
        LookupError: There is no such template or asset.
        jinja2.UndefinedError: The template names what `data` lacks.
    """
    return render_served(template, **data).html


@dataclass(frozen=True)
class ServedPage:
    """A page for a server, and what its Content-Security-Policy has to know of it."""

    html: str
    script_sums: tuple[str, ...]
    """Of its inline scripts: import maps, which browsers read in the page alone."""


def render_served(template: str, **data: Any) -> ServedPage:
    """Return a page for a server with the sums of its inline scripts; errors as `render`."""
    sums: list[str] = []
    html = environment(inline=False).get_template(template).render(script_sums=sums, **data)
    return ServedPage(html, tuple(sums))


def render_file(template: str, **data: Any) -> str:
    """Return a page that is one file: styles, fonts and modules stand in it, and nothing is fetched."""
    return environment(inline=True).get_template(template).render(**data)


def render_part(template: str, inline: bool = True, **data: Any) -> Markup:
    """Return a piece of a page as ready HTML, to be handed to another template."""
    return Markup(environment(inline).get_template(template).render(**data))


def script_sum(text: str) -> str:
    """Return what a Content-Security-Policy calls an inline script by."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


_MARKED = re.compile(r'\bt\(("(?:[^"\\]|\\.)*")')


@cache
def environment(inline: bool) -> Environment:
    """Return the templates' environment of pages that are one file (inline), or of served ones."""
    made = Environment(
        loader=FunctionLoader(lambda name: read_resource(name).decode("utf-8")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals |= _assets(inline) | {"data": _data, "inline": inline, "_": translate, "language": language}
    made.filters |= WORDS
    return made


def _assets(inline: bool) -> dict[str, Callable[..., Any]]:
    """Return what a template asks for files with."""

    def address(name: str) -> str:
        found = asset(name, inline)
        return found.inline if inline else found.address

    def style(name: str) -> Markup:
        if not inline:
            return Markup('<link rel="stylesheet" href="{}">').format(address(name))
        return Markup(f"<style>{asset(name, inline).data.decode()}</style>")

    @pass_context
    def modules(context: Context, names: Iterable[str]) -> Markup:
        names = list(names)
        if not names:
            return Markup("")
        text = plain_json({"imports": {name: address(name) for name in imported(names)}})
        context.get("script_sums", []).append(script_sum(text))
        tags = "".join(f'<script type="module" src="{address(name)}"></script>\n' for name in names)
        return Markup(f'<script type="importmap">{text}</script>\n{tags}')

    return {"asset": address, "style": style, "module_tags": modules, "module_texts": module_texts}


def module_texts(names: Iterable[str]) -> dict[str, str]:
    """Return what modules of a page and all that they import say, English → the reader's language; what differs."""
    told = {text: translate(text) for name in imported(names) for text in _texts_of(name)}
    return {text: translated for text, translated in told.items() if translated != text}


@cache
def _texts_of(module: str) -> tuple[str, ...]:
    """Return the sentences that a module marks by `t("…")`."""
    return tuple(json.loads(text) for text in _MARKED.findall(read_resource(module).decode()))


def _data(value: Any) -> Markup:
    text = plain_json(value).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return Markup(f'<script type="application/json">{text}</script>')
