"""Numbers of an address."""

from __future__ import annotations

import math

from racecraft.serving.http_service import HttpError, Request


def whole_number(request: Request, name: str, usual: int | None = None) -> int:
    """Return a whole number of the address, or raise an `HttpError` (bad_number)."""
    text = request.query.get(name, "" if usual is None else str(usual))
    if not text.isascii() or not text.isdigit() or len(text) > 15:
        raise HttpError(400, "bad_number", f"{name} is {text[:40]!r}; expected a whole number, 0 or more.")
    return int(text)


def number(request: Request, name: str) -> float:
    """Return a finite number of the address, or raise an `HttpError` (bad_number)."""
    text = request.query.get(name, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e6:
        raise HttpError(400, "bad_number", f"{name} is {text[:40]!r}; expected a number.")
    return value
