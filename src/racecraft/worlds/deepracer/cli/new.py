"""`racecraft new`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import word
from racecraft.worlds.deepracer.actions.new import NewFolder
from racecraft.worlds.deepracer.actions.new import new as action


def _show(made: NewFolder) -> None:
    print(f"{made.folder} holds a car to begin with:")
    for name in made.files:
        print(f"  {name}")
    for note in made.notes:
        print(f"- {note}")
    print(f"Open {made.folder / 'reward_function.py'}, change it, then: racecraft train {word(made.folder)}")


new = command(action, _show)
