"""Serve the console."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.served_pages import ServedPages, listen
from racecraft.actions.watch import port_help
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

PORT = 8200
FOLDER = Path("~/racecraft")


@dataclass(frozen=True, kw_only=True)
class ConsoleRequest(Request):
    """Which workspace is opened, and where its pages are."""

    folder: Path = argument("The workspace: models, drafts and runs; made where there is none.", FOLDER)
    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    host: str = option("127.0.0.1", "Listen address; 0.0.0.0: all interfaces, with a token.")
    database: str = option("", "SQLAlchemy's address of the index; by default a SQLite file in the workspace.")
    tls_cert: Path | None = option(None, "Answer by https with this certificate (PEM); --tls-key has its key.")
    tls_key: Path | None = option(None, "Private key of --tls-cert (PEM), without a password.")
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")


@dataclass(frozen=True)
class ServedConsole(ServedPages):
    """The console of a workspace."""

    folder: Path

    def as_dictionary(self) -> dict[str, Any]:
        """Return address and workspace."""
        return {"address": self.address, "folder": str(self.folder)}


@action
def console(request: ConsoleRequest, progress: Progress = quiet) -> ServedConsole:
    """Open the console: train, watch, compare and keep models in the browser; until Ctrl-C.

    Trainings are jobs: they go on when the console ends, and runs of the command line in the same folder appear by
    themselves. Nothing leaves this machine.

    Examples:
        racecraft console

        racecraft console my-workspace --port 9000 --no-open

    Raises:
        PortError: The address cannot be listened on.
    """
    from racecraft.console.application import make_console
    from racecraft.web.access import access_for
    from racecraft.web.server import Tls

    if (request.tls_cert is None) != (request.tls_key is None):
        raise SettingError("found only one of --tls-cert and --tls-key; expected both or none.")
    tls = Tls(request.tls_cert, request.tls_key) if request.tls_cert and request.tls_key else None
    access = access_for(request.host)
    application = make_console(request.folder, access=access, database=request.database)
    address, listening = listen(
        application, access, host=request.host, port=request.port, usual_port=PORT, progress=progress, tls=tls
    )
    return ServedConsole(address, listening, request.open_it, request.folder.expanduser().resolve())
