"""`racecraft check`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import print_next_steps, word
from racecraft.worlds.deepracer.actions.check import Checked
from racecraft.worlds.deepracer.actions.check import check as action


def _show(checked: Checked) -> None:
    for note in checked.notes:
        print(f"- {note}")
    for moment, reward in checked.rewards.items():
        print(f"  reward {moment:16} {reward:10.4g}")
    print(f"{checked.folder} trains: {checked.algorithm} drives car {checked.car} on {checked.track}.")
    print_next_steps(("train it", f"racecraft train {word(checked.folder)}"))


check = command(action, _show)
