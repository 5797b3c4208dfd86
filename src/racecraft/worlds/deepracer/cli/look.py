"""`racecraft look`."""

from __future__ import annotations

from typing import Any

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.look import look as action

MAX_ROWS = 20


def _show(facts: Figures) -> None:
    if "surfaces" in facts:
        print(f"{facts['ticks']} ticks on {facts['track']}: {facts['ended']}.")
        titles: tuple[str, ...] = ("surface", "attention", "of the picture", "times its area", "other decisions")
        rows = [_surface(row) for row in facts["surfaces"]]
    else:
        titles = ("picture", *(title.replace("_", " ") for title in facts["pictures"][0]))
        rows = [
            (str(number), *(one if isinstance(one, str) else f"{one:.3f}" for one in row.values()))
            for number, row in enumerate(facts["pictures"][:MAX_ROWS], 1)
        ]
    table(titles, rows, left=("surface", "chosen", "second"))
    print(
        f"{facts['confidence_values']}: {facts['mean_sureness']:.3g} on average, {facts['least_sureness']:.3g} at least"
    )
    for sentence in facts.get("findings", ()):
        print(sentence)
    print_files(facts.files)


def _surface(row: dict[str, Any]) -> tuple[str, ...]:
    changed = row["decisions_changed_share"]
    return (
        row["surface"], f"{100 * row['attention_share']:.1f} %", f"{100 * row['area_share']:.1f} %",
        f"{row['times_its_area']:.1f}", "-" if changed is None else f"{100 * changed:.0f} %",
    )  # fmt: skip


look = command(action, _show)
