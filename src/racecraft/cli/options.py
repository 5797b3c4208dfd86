"""Options that every command shares which trains something."""

from __future__ import annotations

from typing import Annotated

import typer

Overrides = Annotated[
    list[str] | None, typer.Option("--set", help="group.name=value; `racecraft settings` lists them all.")
]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        help="RUN[:best|last|N|laptime …]: begin with the weights of an earlier run, or of one at an s3:// address; a "
        "merit of `racecraft checkpoints` names the first by it.",
    ),
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the run that --run names.")]
Detach = Annotated[
    bool, typer.Option("--detach", help="Go on as a job: the terminal is free, `racecraft jobs` looks after it.")
]
Cluster = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="N|auto|HOST:PORT",
        help="Carry the worlds by workers: N processes here, or those of a Ray cluster (N@HOST:PORT: so many of it).",
    ),
]
MirrorAt = Annotated[
    str | None, typer.Option("--mirror", help="s3://BUCKET/PREFIX: keep the run there as well, while it trains.")
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]
AlgorithmName = Annotated[
    str | None,
    typer.Option(
        "--algorithm",
        help="What learns: ppo (the default), sac, or your own as module:Class; `racecraft algorithms` lists them.",
    ),
]
