"""What a word means, and what it is called elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.training.glossary import Term


@dataclass(frozen=True, kw_only=True)
class ExplainRequest(Request):
    """Which word."""

    word: tuple[str, ...] = argument("A word, or several: learning rate, lr, DR_RACE_TYPE.")


@dataclass(frozen=True)
class Explained:
    """What a word stands for."""

    word: str
    terms: list[Term]
    """Of the console, the files and the settings."""
    lessons: dict[str, str]
    """Words of the lessons, each with its meaning."""


@action
def explain(request: ExplainRequest, progress: Progress = quiet) -> Explained:
    """Say what a word means and what it is called elsewhere: in the console, the JSON files, run.env, the lessons.

    Examples:

        racecraft explain lr

        racecraft explain gradient descent batch size

        racecraft explain DR_TRAIN_MULTI_CONFIG --json
    """
    from racecraft.training.glossary import WORDS, find_words
    from racecraft.worlds.deepracer.training.glossary import find_terms, nearest_names

    wanted = " ".join(request.word)
    found = find_terms(wanted)
    taught = {word.name: str(word.meaning) for word in find_words(wanted)}
    if not found and not taught:
        near = nearest_names(wanted, [word.name for word in WORDS])
        hint = f"Did you mean {' or '.join(map(repr, near))}?" if near else "The glossary in the docs has them all."
        raise UserInputError(
            "'{wanted}': no such word; expected one of the console, JSON files, run.env, racecraft or lessons. {hint}",
            wanted=wanted,
            hint=hint,
        )
    return Explained(wanted, list(found), taught)
