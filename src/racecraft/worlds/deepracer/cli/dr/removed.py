"""What was there to keep Docker alive: one kind sentence each, and exit code 0, so that old scripts go on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer

WORDS = {"allow_extra_args": True, "ignore_unknown_options": True}

NO_CONTAINER = "there is no container here: a training is one program, and `racecraft jobs list` shows them all."
SENTENCES = {
    "update": "nothing is to be loaded again; dr-update-env reads the settings. To upgrade: pip install -U racecraft.",
    "reload": "nothing is to be loaded again; dr-update-env reads the settings.",
    "find-sagemaker": NO_CONTAINER,
    "find-robomaker": NO_CONTAINER,
    "get-robomaker-stats": "simulated time waits for no clock; steps a second stand in each line of dr-logs-sagemaker.",
    "start-tournament": "was removed from DeepRacer for Cloud long ago; nothing was begun.",
    "list-aws-models": "the console has closed; models lie in the folders of the buckets.",
    "set-upload-model": "the console has closed; write DR_UPLOAD_S3_PREFIX into run.env.",
    "stop-loganalysis": "nothing was left running: dr-start-loganalysis writes a page and ends.",
    "url-loganalysis": "there is no server: dr-start-loganalysis writes a page and says where.",
    "logs-loganalysis": "there is no server: dr-start-loganalysis writes a page and ends.",
    "update-viewer": "nothing is to be updated: the page of dr-start-viewer shows all cars of its run id.",
    "view-stream": "there is no stream of ROS; dr-start-viewer shows all cars.",
    "stop-metrics": "nothing was left running: dr-start-metrics writes a page and ends.",
}
"""What each command that has nothing to do any more says."""


def _answer(name: str, sentence: str) -> Callable[[typer.Context], Any]:
    def answer(context: typer.Context) -> None:
        print(f"dr-{name}: {sentence}")

    answer.__doc__ = f"Has nothing to do any more: {sentence}"
    return answer


COMMANDS = {name: _answer(name, sentence) for name, sentence in SENTENCES.items()}
