"""What a run suggests to try next, each with the command to type. Begin with `advice_of`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from racecraft.analysis.advice import GO_ON, Advice
from racecraft.analysis.learner import learner_of_job
from racecraft.analysis.learning_advice import learning_advice
from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder, ten_minutes_more

TRAIN = "racecraft train"
"""How a command of advice names a training of any kind."""
DEFAULT_ALGORITHM = "ppo"
"""The algorithm of a training that asks for none."""


def advice_of(run: RunFolder) -> list[Advice]:
    """Return what a run suggests, the learner's side first; nothing where there is too little to go by."""
    job, metrics = run.read_job(), run.read_metrics()
    kind = find_kind(str(job.get("kind")), str(run.path))
    learner = learner_of_job(job)
    found = learning_advice(metrics, learner, kind.score.highest)
    of_world = kind.piece("advice")
    if of_world is not None:
        found = of_world(run, learner, found)
    goes_on = f"--resume --stop {ten_minutes_more(metrics)}"
    return [replace(one, command=typed_command(one.command.replace(GO_ON, goes_on), job)) for one in found]


def typed_command(command: str, job: Mapping[str, Any]) -> str:
    """Return a command as this run's training is typed: its world's verb, what it was asked to train on, and by what.

    >>> typed_command("racecraft train --from RUN:best", {"kind": "gymnasium", "asked": {"environment": "CartPole-v1"}})
    'racecraft gym train CartPole-v1 --from RUN:best'
    """
    kind = find_kind(str(job.get("kind")))
    of_world = kind.piece("as_typed")
    text: str = of_world(command, job) if of_world else typed(command, kind.train_command or TRAIN, job)
    return text


def typed(command: str, verb: str, job: Mapping[str, Any], subject: Sequence[Any] = ()) -> str:
    """Return a command of advice with TRAIN replaced; a command that trains nothing stays as it is.

    Args:
        command: As advice gives it.
        verb: What is typed to train, such as "racecraft gym train".
        job: The run's job.json.
        subject: The words that say what is trained on; they are quoted for a shell.
    """
    if command.split()[:2] != TRAIN.split():
        return command
    rest = command.removeprefix(TRAIN)
    if "--run RUN" in rest:
        return f"{verb}{rest}"  # a training that is resumed takes no subject
    return " ".join([verb, *(shlex.quote(str(word)) for word in subject), *_algorithm(job)]) + rest


def _algorithm(job: Mapping[str, Any]) -> list[str]:
    """Return the words that ask for the run's algorithm; none where it is the usual one."""
    name = str(job.get("algorithm", DEFAULT_ALGORITHM))
    return [] if name == DEFAULT_ALGORITHM else ["--algorithm", shlex.quote(name)]
