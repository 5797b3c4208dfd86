"""`racecraft console`: models, trainings and laps in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import Json
from racecraft.contract.errors import SettingError

PORT = 8200
FOLDER = Path("~/racecraft")


def console(
    folder: Annotated[
        Path, typer.Argument(help="The workspace: models, drafts and runs; made where there is none.")
    ] = FOLDER,
    port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help=f"By default {PORT} or, where it is taken, the next free; 0: any free one."
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Listen address; 0.0.0.0: all interfaces, with a token.")] = "127.0.0.1",
    database: Annotated[
        str, typer.Option(help="SQLAlchemy's address of the index; by default a SQLite file in the workspace.")
    ] = "",
    tls_cert: Annotated[
        Path | None, typer.Option(help="Answer by https with this certificate (PEM); --tls-key has its key.")
    ] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Private key of --tls-cert (PEM), without a password.")] = None,
    open_it: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
    json: Json = False,
) -> None:
    """Open the console: train, watch, compare and keep models in the browser; until Ctrl-C.

    Trainings are jobs: they go on when the console ends, and runs of the command line in the same folder appear by
    themselves. Nothing leaves this machine.

    With --host others sign in: `racecraft people invite NAME` makes them a link. Each has models and trainings of
    their own; the address that is printed signs in the owner.

    Examples:

        racecraft console

        racecraft console my-workspace --port 9000 --no-open

        racecraft console --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem
    """
    from racecraft.cli.output import print_json, say
    from racecraft.console.application import make_console
    from racecraft.web.access import access_for
    from racecraft.web.browser import open_page
    from racecraft.web.ports import choose_port
    from racecraft.web.server import Tls, address_of, serve

    if (tls_cert is None) != (tls_key is None):
        raise SettingError("found only one of --tls-cert and --tls-key; expected both or none.")
    tls = Tls(tls_cert, tls_key) if tls_cert and tls_key else None
    chosen, note = choose_port(port, PORT)
    if note:
        say(note, quiet_stdout=json)
    access = access_for(host)
    application = make_console(folder, access=access, database=database)

    def ready(port: int) -> None:
        address = address_of(host, port, access, scheme="https" if tls else "http")
        path = str(folder.expanduser().resolve())
        print_json({"address": address, "folder": path}) if json else print(f"{path} at {address}; Ctrl-C ends it")
        if open_it:
            open_page(address)

    serve(application, host, chosen, ready, tls)
