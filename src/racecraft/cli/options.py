"""Options that commands share."""

from __future__ import annotations

from typing import Annotated

import typer

Cluster = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="N|auto|HOST:PORT",
        help="Carry the worlds by workers: N processes here, or those of a Ray cluster (N@HOST:PORT: so many of it).",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]
