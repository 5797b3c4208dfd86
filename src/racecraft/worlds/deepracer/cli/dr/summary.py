"""`dr-summary`: what this installation is set to, what is at work in it, what its bucket holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from racecraft.cli.options import Json
from racecraft.worlds.deepracer.actions.drfc.summary import summary_of
from racecraft.worlds.deepracer.cli.dr.context import installation

if TYPE_CHECKING:
    pass


def summary(context: typer.Context, json: Json = False) -> None:
    """Show what run.env asks for, what is at work under this run id, and which models the bucket holds.

    Example: racecraft dr summary
    """
    from racecraft.cli.output import print_json

    drfc = installation(context)
    facts = summary_of(drfc)
    if json:
        print_json(facts)
        return
    width = max(map(len, facts))
    for name, value in facts.items():
        text = ", ".join(value) if isinstance(value, list) else value
        print(f"{name:{width}}  {'-' if text in (None, '') else text}")
    for note in drfc.notes:
        print(f"- {note}")
