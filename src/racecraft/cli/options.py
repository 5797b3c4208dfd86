"""Options that every command shares which trains something."""

from __future__ import annotations

from typing import Annotated

import typer

Overrides = Annotated[
    list[str] | None, typer.Option("--set", help="group.name=value; `racecraft settings` lists them all.")
]
From = Annotated[
    str | None, typer.Option("--from", help="RUN[:best|last|N]: begin with the weights of an earlier run.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the run that --run names.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]
