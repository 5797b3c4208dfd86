"""`racecraft explain WORD`: what a word of the console, of a JSON file, of run.env or of ours means, and its others."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from racecraft.cli.options import Json
from racecraft.contract.errors import UserInputError


def explain(
    word: Annotated[list[str], typer.Argument(help="A word, or several: learning rate, lr, DR_RACE_TYPE.")],
    json: Json = False,
) -> None:
    """Say what a word means and what it is called elsewhere: in the console, the JSON files, run.env, racecraft.

    Examples:

        racecraft explain lr

        racecraft explain gradient descent batch size

        racecraft explain DR_TRAIN_MULTI_CONFIG --json
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.training.glossary import find_terms, nearest_names

    wanted = " ".join(word)
    found = find_terms(wanted)
    if not found:
        near = nearest_names(wanted)
        hint = f"Did you mean {' or '.join(map(repr, near))}?" if near else "The glossary in the docs has them all."
        raise UserInputError(
            "'{wanted}': no such word; expected one of the console, of a JSON file, of run.env or of racecraft. {hint}",
            wanted=wanted,
            hint=hint,
        )
    if json:
        print_json({"word": wanted, "terms": [asdict(term) for term in found]})
        return
    for place, term in enumerate(found):
        print("" if place == 0 else "\n", end="")
        print(term.meaning)
        for title, name in (
            ("console", term.console),
            ("JSON", term.json),
            ("run.env", term.variable),
            ("racecraft", term.ours),
        ):
            if name:
                print(f"  {title:9}  {name}")
