"""`racecraft check FOLDER`: whether a racer's folder trains."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import Json


def check(
    folder: Annotated[
        Path, typer.Argument(help="reward_function.py, hyperparameters.json, model_metadata.json; any may be absent.")
    ],
    json: Json = False,
) -> None:
    """Read a folder as `train` does and call its reward function; train nothing. All faults are printed at once.

    Example: racecraft check my-car
    """
    from racecraft.cli.output import print_json, print_next_steps, word
    from racecraft.worlds.deepracer.training.checking import check_folder

    checked = check_folder(folder)
    plan = checked.plan
    car = plan.settings.race.car
    if json:
        facts = {"folder": str(folder), "track": plan.track.name, "car": car, "algorithm": plan.algorithm.name}
        print_json({**facts, "notes": list(plan.notes), "rewards": checked.rewards})
        return
    for note in plan.notes:
        print(f"- {note}")
    for moment, reward in checked.rewards.items():
        print(f"  reward {moment:16} {reward:10.4g}")
    print(f"{folder} trains: {plan.algorithm.name} drives car {car} on {plan.track.name}.")
    print_next_steps(("train it", f"racecraft train {word(folder)}"))
