"""`racecraft telemetry`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.telemetry import TimedLaps
from racecraft.worlds.deepracer.actions.telemetry import telemetry as action


def _show(done: TimedLaps) -> None:
    from racecraft.worlds.deepracer.analysis.telemetry_page import corner_table, lap_table, steady_table
    from racecraft.worlds.deepracer.driving.telemetry.export import lap_names

    compared, facts = done.compared, done.figures
    laps = compared.timing.laps
    title = laps.track.title or laps.track.name
    of = f"{len(laps)} full lap{'s' if len(laps) != 1 else ''}"
    print(f"{title}, {of}; lap {facts['lap']['name']} beside {compared.reference.name}")
    print(f"\n{facts['advice']}\n")
    for part in (corner_table(compared), steady_table(compared)):
        table(part["heads"], part["rows"], left=part["heads"][:1])
        print()
    fastest = lap_table(compared, lap_names(compared.timing))
    rows = [
        (one["name"], *(f"{text}{'*' if best else ' '}" for text, best in one["sectors"]), one["time"], one["gap"])
        for one in fastest["rows"]
    ]
    table(fastest["heads"], rows, left=fastest["heads"][:1])
    print(f"Best sectors together: {fastest['theoretical']} s.")
    print_files(facts.files)


telemetry = command(action, _show, messages_aside=True)
