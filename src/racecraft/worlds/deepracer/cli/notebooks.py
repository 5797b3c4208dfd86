"""`racecraft notebooks`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.notebooks import Notebooks
from racecraft.worlds.deepracer.actions.notebooks import notebooks as action


def _show(done: Notebooks) -> None:
    for path in done.written:
        print(path)
    print(f'Open them: pip install jupyterlab, then jupyter lab "{done.folder}"')


notebooks = command(action, _show)
