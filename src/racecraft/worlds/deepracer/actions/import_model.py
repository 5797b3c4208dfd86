"""Make a run like any other of a model of AWS's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class ImportRequest(Request):
    """Which model is read, and what becomes of it."""

    model: Path = argument("An archive (.tar.gz, .zip), a model folder, a frozen graph (.pb) or a .ckpt.")
    run: Path | None = argument("The new run folder; by default the next free runs/NAME-N.", None)
    metadata: Path | None = option(None, "A model_metadata.json, where none lies beside the weights.")
    track: str | None = option(None, "What it drives; by default what its training_params.yaml names.")


@dataclass(frozen=True)
class Imported:
    """The run that was made."""

    run: Path
    model: Path
    checkpoints: list[int]
    best: int
    notes: list[str]
    """What is worth saying of the model, a clause each."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the fields, the model as "from"."""
        about = {"run": self.run, "from": self.model, "checkpoints": self.checkpoints, "best": self.best}
        return {**about, "notes": self.notes}


@action
def import_model(request: ImportRequest, progress: Progress = quiet) -> Imported:
    """Take in what AWS trained: a console's or a car's archive, a folder of DeepRacer for Cloud, one lone graph.

    No TensorFlow is needed. Whatever is in an archive, nothing of it runs and nothing is written beside the run.

    Examples:

        racecraft import ~/Downloads/my-model.tar.gz

        racecraft import bucket/rl-deepracer-sagemaker runs/old-hand

        racecraft import agent/model.pb --metadata model_metadata.json --track Oval_track
    """
    from racecraft.worlds.deepracer.players import aws_model

    done = aws_model.import_model(request.model, request.run, request.metadata, request.track)
    return Imported(done.run.path, request.model, list(done.checkpoints), done.best, list(done.notes))
