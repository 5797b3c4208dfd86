"""`racecraft actions`."""

from __future__ import annotations

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.cli.output import print_files
from racecraft.worlds.deepracer.actions.action_table import action_table


def _show(facts: Figures) -> None:
    space = facts["action_space"]
    if isinstance(space, dict):
        angle, speed = space["steering_angle"], space["speed"]
        print(f"steering {angle['low']:g} to {angle['high']:g}°, speed {speed['low']:g} to {speed['high']:g} m/s")
    else:
        print(f"{len(space)} actions (degrees, positive left; m/s):")
        by_angle: dict[float, list[str]] = {}
        for action in space:
            by_angle.setdefault(action["steering_angle"], []).append(f"{action['speed']:g}")
        for angle, speeds in by_angle.items():
            print(f"  {angle:6g}°  {', '.join(speeds)}")
    for name, lap in facts["laps_seconds"].items():
        print(f"{name}: best lap {lap:.2f} s" if lap is not None else f"{name}: no lap was found with these actions")
    for name, turns in facts["too_sharp"].items():
        for turn in turns:
            print(f"{name}: no action turns sharply enough, none at full lock is slow enough, for {turn}")
    if "never_chosen" in facts:
        never = facts["never_chosen"]
        if never is None:
            print("no model_metadata.json beside the log: name its table with --table to see which actions are unused")
        else:
            print(f"never chosen in {facts['ticks']} ticks: {', '.join(never) or 'none, all are used'}")
    print_files(facts.files)


actions = command(action_table, _show)
