"""The one place that makes an application of routes. Begin with `make_application`.

SafeHeaders → RequestLimits → Guard (who may ask) → routes, and errors as the page or as JSON
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.pages.assets import PREFIX, find_served
from racecraft.web.access import ONLY_HERE, Access, Guard
from racecraft.web.errors import HANDLERS, WebError
from racecraft.web.headers import SafeHeaders
from racecraft.web.limits import RequestLimits
from racecraft.web.push import Closing

SMALLEST_COMPRESSED = 1400
"""Bytes; what fits into one packet is not compressed."""


def make_application(
    routes: Sequence[BaseRoute],
    access: Access = ONLY_HERE,
    *,
    most_body: Mapping[str, int] | None = None,
    compress: bool = True,
) -> Starlette:
    """Return an application of routes that is guarded, limited and answers errors.

    Args:
        routes: Starlette's; a plain `def` runs in a thread. The styles and modules of pages are added.
        access: Who may ask.
        most_body: Bytes of a body by the path's beginning, where MAX_BODY_BYTES is too little or too much.
        compress: Whether answers above SMALLEST_COMPRESSED bytes are compressed; no for servers that answer fast.
    """
    layers = [Middleware(SafeHeaders), Middleware(RequestLimits, most=most_body), Middleware(Guard, access=access)]
    if compress:
        layers.append(Middleware(GZipMiddleware, minimum_size=SMALLEST_COMPRESSED, compresslevel=5))
    made = Starlette(
        routes=[Route(PREFIX + "{file}", _asset), *routes], middleware=layers, exception_handlers=dict(HANDLERS)
    )
    made.state.closing = Closing()
    return made


async def _asset(request: Request) -> Response:
    """Answer with a style, module, font or picture that a page named; browsers keep it for a year."""
    found = find_served(request.path_params["file"])
    if found is None:
        raise WebError(404, "no_such_asset", "There is no such file; load the page again.")
    return Response(found.data, media_type=found.kind, headers={"Cache-Control": "public, max-age=31536000, immutable"})
