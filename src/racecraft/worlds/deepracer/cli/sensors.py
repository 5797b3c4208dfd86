"""`racecraft sensors`."""

from __future__ import annotations

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.sensors import sensors as action


def _show(seen: Figures) -> None:
    if "rows" in seen:
        print(f"Drawn into {seen['picture']}: {', '.join(seen['rows'])}.")
        return
    for name, part in seen["observations"].items():
        print(f"{name:26} {' x '.join(map(str, part['shape'])):14} {part['doc']}")
    print(f"Drawn into {seen['picture']}.")


sensors = command(action, _show)
