"""`racecraft why`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.why import Explanation
from racecraft.worlds.deepracer.actions.why import why as action


def _show(found: Explanation) -> None:
    print("\n".join(found.sentences))
    print(f"page: {found['page']}")


why = command(action, _show)
