"""Values from the address of a request; a `WebError` (bad_number) says which one cannot be used."""

from __future__ import annotations

import math

from starlette.requests import Request

from racecraft.web.errors import WebError

MOST = 1e6
"""Larger numbers are refused."""


def whole_number(request: Request, name: str, default: int | None = None) -> int:
    """Return a whole number of 0 or more; `default` where it is not named, None: it has to be."""
    text = request.query_params.get(name, "")
    if default is not None and name not in request.query_params:
        return default
    if not (text.isascii() and text.isdigit() and len(text) < 20):
        raise _bad(name, text, "a whole number, 0 or more")
    return int(text)


def number(request: Request, name: str) -> float:
    """Return a number between -MOST and MOST that has to be named."""
    text = request.query_params.get(name, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < MOST:
        raise _bad(name, text, "a number")
    return value


def _bad(name: str, text: str, expected: str) -> WebError:
    return WebError(400, "bad_number", f"{name} is {text[:40]!r}; expected {expected}.")
