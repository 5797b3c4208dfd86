"""The process in which a pupil's function runs: it gives up its rights, then calls the function."""

from __future__ import annotations

import faulthandler
import io
import os
import signal
import sys
import traceback
from typing import Any

from racecraft.isolation.channel import Channel, from_head, to_head
from racecraft.isolation.layers import restrict
from racecraft.isolation.readable import files_of_python

FILE = "your code"
MEMORY_BYTES = 512 << 20


def main() -> None:
    """Answer one message: {"code", "name", "calls"} in the body gives {"values"} in the body, or "error" and "line"."""
    faulthandler.enable()
    if hasattr(faulthandler, "register"):
        faulthandler.register(signal.SIGUSR1, all_threads=False)
    channel = Channel(0, os.dup(1))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    sys.stdout = sys.stderr = io.StringIO()
    restrict(files_of_python(), MEMORY_BYTES)
    _, body = channel.receive()
    head, values = _answer(from_head(body))
    channel.send(to_head(head), to_head({"values": values}))


def _answer(request: dict[str, Any]) -> tuple[dict[str, Any], list[Any]]:
    names: dict[str, Any] = {"__name__": "__main__"}
    try:
        exec(compile(request["code"], FILE, "exec"), names)
        function = names.get(request["name"])
        if not callable(function):
            return {"error": f"there is no function {request['name']}; define it", "line": 1}, []
        values = [function(*call) for call in request["calls"]]
        to_head({"values": values})
        return {}, values
    except SyntaxError as error:
        return {"error": f"{error.msg}", "line": error.lineno or 1}, []
    except (Exception, SystemExit) as error:
        lines = [one.lineno for one in traceback.extract_tb(error.__traceback__) if one.filename == FILE]
        return {"error": f"{type(error).__name__}: {error}", "line": lines[-1] if lines else 1}, []
