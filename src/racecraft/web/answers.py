"""What a route returns: a page, JSON, a picture. All carry the headers that keep a page to itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from racecraft.pages.plain_json import plain_json
from racecraft.pages.render import render_served

FRESH = {"Cache-Control": "no-store"}


class JsonResponse(Response):
    """JSON without NaN."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """Return the bytes of a value."""
        return plain_json(content).encode()


def json_answer(value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a value as JSON; what is no number is null. Browsers do not keep it."""
    return JsonResponse(value, status, FRESH | dict(headers or {}))


def picture_answer(data: bytes, kind: str) -> Response:
    """Return a picture, a film or another file by its media type. Browsers do not keep it."""
    return Response(data, media_type=kind, headers=FRESH)


def page_answer(
    request: Request, template: str, *, status: int = 200, headers: Mapping[str, str] | None = None, **data: Any
) -> Response:
    """Return a page.

    Args:
        request: What is answered; the page's forms carry its token (`form_token` in the template).
        template: As `pages.render.render` takes it.
        status: HTTP status.
        headers: Further ones; a Content-Security-Policy here takes the place of ours.
        data: What the template names.
    """
    served = render_served(template, form_token=request.scope.get("racecraft.form_token", ""), **data)
    own = FRESH | {"Content-Security-Policy": security_policy(served.script_sums)} | dict(headers or {})
    return Response(served.html, status, own, "text/html")


def security_policy(script_sums: Sequence[str] = ()) -> str:
    """Return what a page may load: its server's files, and the inline scripts with these sums."""
    scripts = " ".join(["'self'", *script_sums])
    return (
        f"default-src 'self'; script-src {scripts}; img-src 'self' data: blob:; media-src 'self' blob:; "
        "frame-ancestors 'none'; base-uri 'none'; form-action 'self'; object-src 'none'"
    )
