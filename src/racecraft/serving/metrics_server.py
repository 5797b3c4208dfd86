"""Figures of a running training for Prometheus to fetch: `GET /metrics`, in a thread beside the training."""

from __future__ import annotations

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest

from racecraft.web.access import ANYONE, ONLY_HERE
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, JsonApi, Reply, guarded
from racecraft.web.ports import is_loopback
from racecraft.web.server import ServerThread

PATH = "/metrics"


class MetricsServer:
    """Serves a registry. On an address of other machines it answers whoever asks, under any name.

    Args:
        registry: What Prometheus's client reads.
        host: Address to listen on.
        port: Port; 0: any free one.

    Raises:
        PortError: The address cannot be listened on.
    """

    def __init__(self, registry: CollectorRegistry, host: str, port: int) -> None:
        self._registry = registry
        access = ONLY_HERE if is_loopback(host) else ANYONE
        self._thread = ServerThread(guarded(JsonApi(self._answer), access), "racecraft-metrics")
        self.address = f"http://{host}:{self._thread.start(host, port)}{PATH}"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    async def _answer(self, request: ApiRequest) -> Reply:
        if request.path != PATH:
            raise WebError(404, "not_found", f"there is no {request.path[:80]}; expected {PATH}.")
        if request.method != "GET":
            raise WebError(405, "wrong_method", f"{request.method} {PATH}; expected GET.")
        return Reply(generate_latest(self._registry), CONTENT_TYPE_LATEST)
