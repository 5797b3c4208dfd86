"""`racecraft algorithms`: what can learn, and which actions it can decide."""

from __future__ import annotations

import typer


def algorithms(json: bool = typer.Option(False, "--json", help="One JSON object on one line.")) -> None:
    """List every algorithm that `--algorithm` takes: the built-in ones and those of installed packages.

    Example: racecraft algorithms
    """
    from rich.table import Table

    from racecraft.algorithms.registry import all_algorithms
    from racecraft.cli.output import print_json, print_table

    found = all_algorithms()
    if json:
        told = [{"name": one.name, "title": one.title, "acts": list(one.acts), "settings": one.group} for one in found]
        print_json({"algorithms": told})
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("algorithm", "decides", "what it is"):
        table.add_column(title, no_wrap=title == "algorithm")
    for one in found:
        table.add_row(one.name, one.action_kinds_text, one.title)
    print_table(table)
    print("\nYour own: --algorithm module:Class. Settings of one: racecraft settings --algorithm NAME")
