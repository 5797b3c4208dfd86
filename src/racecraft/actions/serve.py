"""Serve a trained policy over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.actions.named_run import RUN_HELP
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.serving.endpoint import Endpoint
    from racecraft.web.access import Access
    from racecraft.web.server import ListeningServer


@dataclass(frozen=True, kw_only=True)
class ServeRequest(Request):
    """Which policy is served, and where."""

    run: str = argument(f"{RUN_HELP} Of any world. With --entry-point: a model's folder.", metavar="RUN[:which]")
    port: int = option(8080, "0: any free one.", low=0, high=65535)
    host: str = option("127.0.0.1", "Listen address; 0.0.0.0: all interfaces.")
    policy: str = option("", "Whose rows, where groups have policies of their own.")
    entry_point: Path | None = option(
        None, "A file whose model_fn, input_fn, predict_fn and output_fn serve the model, in a limited process."
    )
    trust_model: bool = option(False, "Give these functions all your rights: files, network, programs.")
    env: tuple[str, ...] = option(
        (), "An environment variable of these functions; may be repeated.", metavar="NAME=VALUE"
    )
    ready: Path | None = option(None, "File that receives the address.", is_hidden=True)


@dataclass(frozen=True)
class ServedPolicy(Served):
    """An endpoint that answers GET /ping and POST /invocations."""

    url: str
    server: Endpoint
    listening: ListeningServer
    ready_file: Path | None

    @property
    def run(self) -> Path:
        """The run folder, or the model's."""
        return self.server.folder

    def as_dictionary(self) -> dict[str, Any]:
        """Return the address and what is served: run and iteration, or model, entry point and what restricts it."""
        return {"url": self.url, **self.server.as_dictionary()}

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
        progress(server.summary())


@action
def serve(request: ServeRequest, progress: Progress = quiet) -> ServedPolicy:
    """Answer GET /ping and POST /invocations for a trained policy, until Ctrl-C or SIGTERM.

    Observations come as JSON ({"instances": […]} or {"inputs": {…}}), as .npy or .npz, or as a PNG or JPEG picture.

    Examples:

        racecraft serve runs/CartPole-v1-1

        racecraft serve runs/reinvent_base-1:last --port 0 --json

        racecraft serve model --entry-point inference.py

        curl -H 'Content-Type: image/png' --data-binary @frame.png http://127.0.0.1:8080/invocations

    Raises:
        RunFolderError: No run folder.
        SettingError: This system cannot restrict the functions of --entry-point, and they are not trusted.
        ModelLoadError: They, or their model, cannot be loaded.
        PortError: The address cannot be listened on.
    """
    from racecraft.serving.quick_answers import answer_before_thinking, freeze_loaded
    from racecraft.web.access import ANYONE, ONLY_HERE
    from racecraft.web.ports import is_loopback
    from racecraft.web.server import ListeningServer

    answer_before_thinking()
    server = _endpoint(request, ONLY_HERE if is_loopback(request.host) else ANYONE)
    server.warm_up()
    freeze_loaded()
    listening = ListeningServer(server.application, request.host, request.port)
    return ServedPolicy(f"http://{request.host}:{listening.port}", server, listening, request.ready)


def _endpoint(request: ServeRequest, access: Access) -> Endpoint:
    if request.entry_point is None:
        from racecraft.players.trained import load_policy
        from racecraft.serving.endpoint_server import EndpointServer

        _require_no(bool(request.env), "--env", "it goes with --entry-point, whose functions read it")
        _require_no(request.trust_model, "--trust-model", "it goes with --entry-point, whose functions it trusts")
        return EndpointServer(load_policy(request.run), request.policy, access)
    from racecraft.serving.model_server import ModelServer

    _require_no(bool(request.policy), "--policy", "model_fn of --entry-point chooses what answers")
    environment = dict(_name_and_value(one) for one in request.env)
    return ModelServer(request.entry_point, Path(request.run), request.trust_model, access, environment=environment)


def _name_and_value(variable: str) -> tuple[str, str]:
    name, is_there, value = variable.partition("=")
    if not name or not is_there:
        raise SettingError("--env is {found!r}; expected NAME=VALUE.", found=variable)
    return name, value


def _require_no(is_given: bool, name: str, why: str) -> None:
    if is_given:
        raise SettingError("found {name}; expected none: {why}.", name=name, why=why)
