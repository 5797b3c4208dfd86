"""`racecraft import`: a model of AWS's becomes a run like any other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def import_(
    model: Annotated[
        Path, typer.Argument(help="An archive (.tar.gz, .zip), a model folder, a frozen graph (.pb) or a .ckpt.")
    ],
    run: Annotated[
        Path | None, typer.Argument(help="The new run folder; by default the next free runs/NAME-N.")
    ] = None,
    metadata: Annotated[
        Path | None, typer.Option(help="A model_metadata.json, where none lies beside the weights.")
    ] = None,
    track: Annotated[
        str | None, typer.Option(help="What it drives; by default what its training_params.yaml names.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Take in what AWS trained: a console's or a car's archive, a folder of DeepRacer for Cloud, one lone graph.

    No TensorFlow is needed. Whatever is in an archive, nothing of it runs and nothing is written beside the run.

    Examples:

        racecraft import ~/Downloads/my-model.tar.gz

        racecraft import bucket/rl-deepracer-sagemaker runs/old-hand

        racecraft import agent/model.pb --metadata model_metadata.json --track Oval_track
    """
    from racecraft.cli.output import print_json, print_next_steps, word
    from racecraft.worlds.deepracer.players.aws_model import import_model

    done = import_model(model, run, metadata, track)
    if json:
        print_json({"run": str(done.run.path), "from": str(model), "checkpoints": list(done.checkpoints),
                    "best": done.best, "notes": list(done.notes)})  # fmt: skip
        return
    for note in done.notes:
        print(f"- {note}")
    which = ", ".join(map(str, done.checkpoints))
    print(f"{done.run.path}: checkpoints {which}; best {done.best}. What to try next:")
    run_word = word(done.run.path)
    print_next_steps(
        ("film a lap", f"racecraft evaluate {run_word} --video lap.mp4"),
        ("train it on, in a folder with its model_metadata.json", f"racecraft train --from {run_word} --preset aws"),
    )
