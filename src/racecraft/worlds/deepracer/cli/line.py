"""`racecraft line`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.line import FoundLines
from racecraft.worlds.deepracer.actions.line import line as action


def _show(found: FoundLines) -> None:
    from racecraft.worlds.deepracer.driving.lap_times import PLANNED, SOLVER
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs

    times = found.times
    print(found.title)
    remarks = {PLANNED: "driven lap by lap in the world", SOLVER: "estimate, minimum time"}
    rows = []
    for name, one in times.lines.items():
        figures = (f"{times.seconds(name):.2f} s", f"{one.arc[-1]:.1f} m", f"{one.speed.min():.2f} m/s")
        rows.append((name, *figures, remarks.get(name, "estimate, by the car's limits along the line")))
    table(("line", "lap", "length", "slowest", ""), rows, left=("line", ""))
    if times.plan is None:
        print("No lap was found with these actions: they are too fast, or steer too little, for this track.")
    if times.best_seconds is not None:
        print(f"Best known lap of {found.car} up to {times.top_speed:g} m/s: {times.best_seconds:.2f} s")
    if (note := beyond_logs(found.car, times.top_speed)) is not None:
        print(note)
    print_files(found.files)


line = command(action, _show)
