"""`racecraft telemetry`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.telemetry import TimedLaps
from racecraft.worlds.deepracer.actions.telemetry import telemetry as action

SHOWN_LAPS = 10


def _show(done: TimedLaps) -> None:
    from racecraft.cli.output import print_table

    compared, facts = done.compared, done.figures
    laps = compared.timing.laps
    title = laps.track.title or laps.track.name
    of = f"{len(laps)} full lap{'s' if len(laps) != 1 else ''}"
    print(f"{title}, {of}; lap {facts['lap']['name']} beside {compared.reference.name}")
    print(f"\n{facts['advice']}\n")
    print_table(_zone_table(facts))
    print()
    print_table(_lap_table(facts))
    print(f"Best sectors together: {facts['theoretical_best_seconds']:.2f} s.")
    for kind, path in facts.files.items():
        print(f"{kind}: {path}")


def _zone_table(facts: Mapping[str, Any]) -> Any:
    table = _table("corner", "lap", "reference", "lost", "slowest", "there", "best", "spread", "with lap")
    for zone in facts["corners"]:
        table.add_row(
            zone["name"], _figure(zone["seconds"]), _figure(zone["reference_seconds"]),
            _figure(zone["lost_seconds"], "+.2f"), _figure(zone["slowest_mps"], ".1f"),
            _figure(zone["reference_slowest_mps"], ".1f"), _figure(zone["best_seconds"]),
            _figure(zone["spread_seconds"]), _figure(zone["correlation"], "+.2f"),
        )  # fmt: skip
    if facts["start_seconds"]:
        table.add_row("standing start", "", "", _figure(facts["start_seconds"], "+.2f"), "", "", "", "", "")
    return table


def _lap_table(facts: Mapping[str, Any]) -> Any:
    count = len(facts["best_sector_seconds"])
    table = _table("lap", *(f"sector {k + 1}" for k in range(count)), "time", "gap")
    for one in facts["laps"][:SHOWN_LAPS]:
        sectors = [
            f"{seconds:.2f}{'*' if seconds <= best + 1e-9 else ' '}"
            for seconds, best in zip(one["sector_seconds"], facts["best_sector_seconds"], strict=True)
        ]
        table.add_row(one["name"], *sectors, f"{one['seconds']:.2f}", _figure(one["gap_seconds"], "+.2f"))
    return table


def _table(*heads: str) -> Any:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in heads:
        table.add_column(head, justify="left" if head in ("corner", "lap") and head == heads[0] else "right")
    return table


def _figure(value: float | None, form: str = ".2f") -> str:
    return "–" if value is None else f"{value:{form}}"


telemetry = command(action, _show, messages_aside=True)
