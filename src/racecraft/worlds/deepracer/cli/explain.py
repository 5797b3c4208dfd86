"""`racecraft explain`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.explain import Explained
from racecraft.worlds.deepracer.actions.explain import explain as action


def _show(explained: Explained) -> None:
    for name, meaning in explained.lessons.items():
        print(f"{name}: {meaning}")
    for index, term in enumerate(explained.terms):
        print("\n" if index or explained.lessons else "", end="")
        print(term.meaning)
        for title, name in (
            ("console", term.console),
            ("JSON", term.json),
            ("run.env", term.variable),
            ("racecraft", term.ours),
        ):
            if name:
                print(f"  {title:9}  {name}")


explain = command(action, _show)
