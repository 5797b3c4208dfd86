"""A page that is also a file to keep or send: its own head names what it may load, inline scripts included."""

from __future__ import annotations

from starlette.responses import Response

from racecraft.web.answers import FRESH


def own_page(html: str) -> Response:
    """Return a page whose Content-Security-Policy stands in its head; no other page may frame it."""
    return Response(html, media_type="text/html", headers=FRESH | {"Content-Security-Policy": "frame-ancestors 'none'"})
