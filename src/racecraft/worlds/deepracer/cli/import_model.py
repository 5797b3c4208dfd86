"""`racecraft import`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.output import print_next_steps, word
from racecraft.worlds.deepracer.actions.import_model import Imported, import_model


def _show(done: Imported) -> None:
    for note in done.notes:
        print(f"- {note}")
    print(f"{done.run}: checkpoints {', '.join(map(str, done.checkpoints))}; best {done.best}. What to try next:")
    run = word(done.run)
    print_next_steps(
        ("film a lap", f"racecraft evaluate {run} --video lap.mp4"),
        ("train it on, in a folder with its model_metadata.json", f"racecraft train --from {run} --preset aws"),
    )


import_ = command(import_model, _show)
