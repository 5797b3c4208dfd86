"""Serve a trained policy over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.actions.named_run import RUN_HELP
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.serving.endpoint_server import EndpointServer
    from racecraft.web.server import ListeningServer


@dataclass(frozen=True, kw_only=True)
class ServeRequest(Request):
    """Which policy is served, and where."""

    run: str = argument(f"{RUN_HELP} Of any world.", metavar="RUN[:which]")
    port: int = option(8080, "0: any free one.", low=0, high=65535)
    host: str = option("127.0.0.1", "Listen address; 0.0.0.0: all interfaces.")
    policy: str = option("", "Whose rows, where groups have policies of their own.")
    ready: Path | None = option(None, "File that receives the address.", is_hidden=True)


@dataclass(frozen=True)
class ServedPolicy(Served):
    """An endpoint that answers GET /ping and POST /invocations."""

    url: str
    server: EndpointServer
    listening: ListeningServer
    ready_file: Path | None

    @property
    def run(self) -> Path:
        """The run folder."""
        return self.server.policy.run.path

    def as_dictionary(self) -> dict[str, Any]:
        """Return address, run and iteration."""
        return {"url": self.url, "run": str(self.run), "iteration": self.server.policy.checkpoint.iteration}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Answer until Ctrl-C or SIGTERM; then tell what was answered."""
        from json import dumps

        from racecraft.formats.atomic import write_atomic

        server = self.server
        try:
            if self.ready_file is not None:
                write_atomic(self.ready_file, dumps({"url": self.url}) + "\n")
            ready()
            self.listening.run()
        finally:
            server.close()
        progress(
            f"{server.requests} answers in {server.batches} batches, {server.refused} refused, "
            f"p99 {server.p99_ms():.1f} ms"
        )


@action
def serve(request: ServeRequest, progress: Progress = quiet) -> ServedPolicy:
    """Answer GET /ping and POST /invocations for a trained policy, until Ctrl-C or SIGTERM.

    Observations come as JSON ({"instances": […]} or {"inputs": {…}}), as .npy or .npz, or as a PNG or JPEG picture.

    Examples:

        racecraft serve runs/CartPole-v1-1

        racecraft serve runs/reinvent_base-1:last --port 0 --json

        curl -H 'Content-Type: image/png' --data-binary @frame.png http://127.0.0.1:8080/invocations

    Raises:
        RunFolderError: No run folder.
        PortError: The address cannot be listened on.
    """
    from racecraft.players.trained import load_policy
    from racecraft.serving.endpoint_server import EndpointServer
    from racecraft.serving.quick_answers import answer_before_thinking, settle
    from racecraft.web.access import ANYONE, ONLY_HERE
    from racecraft.web.ports import is_loopback
    from racecraft.web.server import ListeningServer

    answer_before_thinking()
    access = ONLY_HERE if is_loopback(request.host) else ANYONE
    server = EndpointServer(load_policy(request.run), request.policy, access)
    server.warm_up()
    settle()
    listening = ListeningServer(server.application, request.host, request.port)
    return ServedPolicy(f"http://{request.host}:{listening.port}", server, listening, request.ready)
