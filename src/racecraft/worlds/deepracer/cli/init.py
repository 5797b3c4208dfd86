"""`racecraft init`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import word
from racecraft.worlds.deepracer.actions.init import NewInstallation
from racecraft.worlds.deepracer.actions.init import init as action


def _show(made: NewInstallation) -> None:
    for path in made.made:
        print(f"made  {path}")
    for path in made.kept:
        print(f"kept  {path}")
    print(f"\ncd {word(made.folder)}\nsource ./{made.activate}")
    print("dr-update-env\ndr-upload-custom-files\ndr-start-training")


init = command(action, _show)
