"""What every endpoint answers, as SageMaker's containers: `GET /ping`, `GET /`, `POST /invocations`."""

from __future__ import annotations

import json
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, JsonApi, Reply, guarded

SECONDS_FOR_AN_ANSWER = 60.0
"""As at SageMaker."""
LATENCIES_KEPT = 10_000


class Endpoint:
    """Counts and routes; a subclass decides.

    Args:
        access: Who may ask.
    """

    def __init__(self, access: Access = ONLY_HERE) -> None:
        self.application = guarded(JsonApi(self._route), access)
        """To be served."""
        self.requests = self.refused = 0
        self.latencies_ms: deque[float] = deque(maxlen=LATENCIES_KEPT)

    @property
    def folder(self) -> Path:
        """The folder of what is served."""
        raise NotImplementedError

    def as_dictionary(self) -> dict[str, Any]:
        """Return what is served, for programs."""
        raise NotImplementedError

    def summary(self) -> str:
        """Return what was answered, as a sentence."""
        return f"{self.requests} answers, {self.refused} refused, p99 {self.p99_ms():.1f} ms"

    def warm_up(self) -> None:
        """Do what the first to ask would wait for."""

    def close(self) -> None:
        """Let go of threads and processes, when the application is served no more."""
        raise NotImplementedError

    def p99_ms(self) -> float:
        """Return how long 99 of 100 answers took at most, in this process, ms; 0 before the first."""
        return float(np.percentile(self.latencies_ms, 99)) if self.latencies_ms else 0.0

    def _signature(self) -> dict[str, Any]:
        """Return what is expected and given, for `GET /`."""
        raise NotImplementedError

    async def _invoked(self, request: ApiRequest) -> Reply:
        """Return the answer to an invocation; raises `WebError`."""
        raise NotImplementedError

    async def _route(self, request: ApiRequest) -> Reply:
        if request.path == "/ping":
            return Reply(b"{}")
        if request.path == "/" and request.method == "GET":
            return Reply(json.dumps(self._signature()).encode())
        if request.path != "/invocations":
            raise WebError(404, "not_found", f"there is no {request.path[:80]}; expected /ping or /invocations.")
        if request.method != "POST":
            raise WebError(405, "method", f"{request.method} /invocations; expected POST.")
        reply = await self._invoked(request)
        self.requests += 1
        self.latencies_ms.append((time.monotonic() - request.arrived) * 1000)
        return reply
