"""The process in which a model's own functions answer (`model_functions.py`); `model_process.py` has the other end.

    {"load": {…}}                          gives up its rights, loads file and model   → {"layers": […]}
    {"answer": [content_type, accept]},    asks the functions                          → {"content_type": …},
        body                                                                                body

Any answer may also hold "printed", what they printed, and "error": [status, name, sentence].
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RacecraftError
from racecraft.isolation.channel import Channel, from_head, to_head
from racecraft.isolation.layers import restrict
from racecraft.isolation.worker import Printed, run_worker
from racecraft.serving.model_functions import ModelFunctions
from racecraft.web.errors import WebError


def main() -> None:
    """Answer until the owner closes the pipe."""
    run_worker(lambda channel, printed: Worker(channel, printed).answer)


class Worker:
    """The functions of one file, once it is loaded."""

    def __init__(self, channel: Channel, printed: Printed) -> None:
        self._channel, self._printed = channel, printed
        self._functions: ModelFunctions

    def answer(self, head: bytes, body: bytes) -> None:
        """Do what a message asks, and send the answer."""
        request = from_head(head)
        reply: dict[str, Any] = {}
        answer = b""
        try:
            if "load" in request:
                reply["layers"] = self._load(request["load"])
            else:
                answer, reply["content_type"] = self._functions.answer(body, *request["answer"])
        except WebError as error:
            reply["error"] = [error.status, error.name, error.sentence]
        except RacecraftError as error:
            reply["error"] = [500, "model_failed", str(error)]
        self._channel.send(to_head({**reply, "printed": self._printed.pop()}), answer)

    def _load(self, request: dict[str, Any]) -> tuple[str, ...]:
        layers: tuple[str, ...] = ()
        os.environ.update(request["environment"])
        if request["readable"] is not None:
            layers = restrict(request["readable"], request["memory_bytes"], threads=True)
        self._functions = ModelFunctions(Path(request["path"]), Path(request["model"]))
        return layers
