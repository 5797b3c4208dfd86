"""`racecraft algorithms`."""

from __future__ import annotations

from racecraft.actions.algorithms import AlgorithmList
from racecraft.actions.algorithms import algorithms as action
from racecraft.cli.from_request import command
from racecraft.cli.output import table


def _show(found: AlgorithmList) -> None:
    rows = [(one.name, one.action_kinds_text, one.title) for one in found.algorithms]
    table(("algorithm", "decides", "what it is"), rows, left=("algorithm", "decides", "what it is"))
    print("\nYour own: --algorithm module:Class. Settings of one: racecraft settings --algorithm NAME")


algorithms = command(action, _show)
