"""`racecraft compare`."""

from __future__ import annotations

from typing import Any

from racecraft.actions.compare import Comparison
from racecraft.actions.compare import compare as action
from racecraft.cli.from_request import command
from racecraft.cli.output import table

MAX_ROWS = 12


def show(found: Comparison) -> None:
    """Print a comparison for people: the verdict, a row a group, a row a setting that differs."""
    print(" ".join(found.verdict) + "\n")
    rows = []
    for place in found.order:
        group = found.groups[place]
        seeds = ", ".join(_figure(one.score) for one in group.seeds)
        reached = sum(one.reached_share for one in group.seeds) / len(group.seeds)
        interval = "–" if group.low is None else f"{group.low:.2f} to {group.high:.2f}"
        rows.append((group.name, str(len(group.seeds)), _figure(group.mean), interval, f"{100 * reached:.0f} %", seeds))
    titles = ("group", "seeds", f"IQM of {found.measure}", "95 %", "reached", "each seed")
    table(titles, rows, left=("group", titles[-1]))
    if found.differences:
        print()
        rows = [(one["name"], *map(_value, one["values"])) for one in found.differences[:MAX_ROWS]]
        heads = ("what differs", *(group.name for group in found.groups))
        table(heads, rows, left=heads)
        if len(found.differences) > MAX_ROWS:
            print(f"and {len(found.differences) - MAX_ROWS} more; --json names them all")
    if found.page:
        print(f"\npage: {found.page}")


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _value(value: Any) -> str:
    text = "–" if value is None else str(value)
    return text if len(text) <= 40 else f"{text[:39]}…"


compare = command(action, show)
