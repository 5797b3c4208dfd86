"""`racecraft logs`."""

from __future__ import annotations

import sys
from typing import Any

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.logs import logs as action


def show(facts: Figures) -> None:
    """Print what a log holds, and what to change before the next training."""
    several = len(facts["models"]) > 1
    where = (
        f"on {facts['track']}{', reversed' if facts['reversed'] else ''}" if facts["track"] else "on an unknown track"
    )
    where = f"of {len(facts['models'])} models" if several else where
    print(f"{facts['ticks']:,} steps in {facts['files']} file(s), {where}." if facts["ticks"] else "Metrics only.")
    _print_table(facts["phases"] or facts.get("metrics", []))
    for model in facts["models"]:
        advice = [one for one in facts["advice"] if one["model"] == model["model"]]
        if several:
            rounds = ", ".join(map(str, model["rounds"]))
            print(f"\n{model['model']} (round {rounds}), on {model['track'] or 'an unknown track'}:")
        if advice:
            print("Before the next training:" if several else "\nBefore the next training:")
        for number, one in enumerate(advice, 1):
            print(f"{number}. {one['found']}\n   {one['try']}")
        if "page" in model:
            print(f"page: {model['page']}")
    if facts["damaged"]:
        print(f"{len(facts['damaged'])} thing(s) in the files could not be taken as they stand; see above.")
    print_files(facts.files)
    if facts["ticks"] and "page" not in facts and not any("page" in model for model in facts["models"]):
        print("Every plot, to click through: add --page logs.html", file=sys.stderr)


def _print_table(rows: list[dict[str, Any]]) -> None:
    several, cells = len({row["round"] for row in rows}) > 1, []
    for row in rows:
        best, share, reward = (row[name] for name in ("best_lap_seconds", "mean_progress_share", "mean_reward"))
        cells.append((
            (f"round {row['round']}, " if several else "") + f"{row['phase']} {row['stream']}".strip(),
            f"{row['iterations']:,}", f"{row['episodes']:,}", f"{row['full_laps']:,}",
            "-" if best is None else f"{best:.2f} s", "-" if share is None else f"{100 * share:.1f} %",
            "-" if reward is None else f"{reward:,.1f}",
        ))  # fmt: skip
    heads = ("what", "iterations", "episodes", "full laps", "best lap", "mean progress", "mean reward")
    table(heads, cells, left=("what",))


logs = command(action, show, messages_aside=True)
