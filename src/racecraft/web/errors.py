"""What a server answers instead of what was asked for: as a page for a browser, as JSON for a program.

JSON: {"error": one word for programs, "message": a sentence for people}.
"""

from __future__ import annotations

import errno
import logging
from collections.abc import Mapping

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from racecraft.contract.errors import UserInputError
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.headers import ALWAYS

_NAMES = {404: "not_found", 405: "wrong_method"}
_log = logging.getLogger(__name__)


class WebError(Exception):
    """A request that is answered with an error.

    Args:
        status: HTTP status, 400 to 599.
        name: One word for programs, such as "bad_json".
        sentence: What was found, what was expected, what to do.
    """

    def __init__(self, status: int, name: str, sentence: str) -> None:
        super().__init__(sentence)
        self.status, self.name, self.sentence = status, name, sentence


def error_answer(request: Request, status: int, name: str, sentence: str) -> Response:
    """Return the page or the JSON of an error, by what was asked for."""
    headers = {"Connection": "close"} if status == 408 else {}
    if "text/html" in request.headers.get("accept", ""):
        return page_answer(
            request, "error.html", status=status, headers=headers, title=_title(status), sentence=sentence
        )
    return json_answer({"error": name, "message": sentence}, status=status, headers=headers)


def on_web_error(request: Request, error: Exception) -> Response:
    """Answer a `WebError`."""
    assert isinstance(error, WebError)
    return error_answer(request, error.status, error.name, error.sentence)


def on_user_error(request: Request, error: Exception) -> Response:
    """Answer something that the user gave and that cannot be used."""
    return error_answer(request, 422, "not_usable", str(error))


def on_http_error(request: Request, error: Exception) -> Response:
    """Answer what Starlette itself finds: no such path, a method that is not meant."""
    assert isinstance(error, HTTPException)
    name = _NAMES.get(error.status_code, "bad_request")
    path = request.url.path[:80]
    sentences: Mapping[int, str] = {
        404: f"There is no {path} here; begin at /.",
        405: f"{path} does not answer {request.method[:20]}.",
    }
    return error_answer(request, error.status_code, name, sentences.get(error.status_code, error.detail))


def on_os_error(request: Request, error: Exception) -> Response:
    """Answer a full disk by its name; any other error of the system is nobody's doing, as in `on_failure`."""
    if not isinstance(error, OSError) or error.errno not in (errno.ENOSPC, errno.EDQUOT):
        raise error
    sentence = "The disk is full; nothing of this was kept. Free some space and send it again."
    return error_answer(request, 507, "disk_full", sentence)


def on_failure(request: Request, error: Exception) -> Response:
    """Answer what nobody foresaw; the server lives on, and its terminal shows the traceback."""
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    answer = error_answer(request, 500, "internal", f"{type(error).__name__}: {str(error)[:200]}")
    for name, value in ALWAYS.items():  # Starlette makes this answer outside of all layers
        answer.headers.setdefault(name, value)
    return answer


def on_gone(request: Request, error: Exception) -> Response:
    """Answer nobody: the other end left while it still sent."""
    return Response(status_code=400)


HANDLERS = {
    ClientDisconnect: on_gone,
    WebError: on_web_error,
    UserInputError: on_user_error,
    HTTPException: on_http_error,
    OSError: on_os_error,
    Exception: on_failure,
}


def _title(status: int) -> str:
    return {401: "This page needs its token", 403: "Not allowed", 404: "Not found", 507: "The disk is full"}.get(
        status, "That did not work"
    )
