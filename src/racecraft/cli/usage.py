"""Words that make no command line, as errors of ours. Begin with `usage_error`.

Typer finds them; here each becomes data: which command, what was found, what it takes, the nearest known name.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from typing import Any

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.message import Message

NO_COMMAND = re.compile(r"No such command '(.*?)'")
LEFT_OVER = re.compile(r"Got unexpected extra argument\S* \((.*)\)")
"""What Typer writes into a text alone."""


class UsageError(UserInputError):
    """Words that make no command line: an unknown command or option, a value that is missing or one too many."""


def usage_error(found: Any) -> UsageError:
    """Return what Typer found as an error of ours.

    Args:
        found: Typer's exception, of its own classes or of click's, by its version: its context, its text, and for some
            the option or parameter in question.
    """
    kind, text, context = type(found).__name__, found.format_message(), getattr(found, "ctx", None)
    command = _words_of(context)
    if kind == "NoSuchOption":
        fields = _not_found(command, found.option_name, _options(context))
        return UsageError("`{command}` has no option '{found}'. {hint}", **fields)
    if unknown := NO_COMMAND.match(text):
        fields = _not_found(command, unknown[1], _commands(context))
        return UsageError("`{command}` has no command '{found}'. {hint}", **fields)
    if text == "Missing command.":
        known = ", ".join(_commands(context))
        return UsageError("`{command}` has no command; expected one of {expected}.", command=command, expected=known)
    if kind == "MissingParameter":
        missing = _typed_name(found.param)
        return UsageError("{missing} was not given; `{command} --help` describes it.", command=command, missing=missing)
    if left_over := LEFT_OVER.match(text):
        return UsageError(
            "`{command}` takes no '{found}'; `{command} --help` lists what it takes.",
            command=command,
            found=left_over[1],
        )
    if kind == "BadOptionUsage" and "does not take a value" in text:
        return UsageError("{option} has a value; expected none.", option=found.option_name)
    if kind == "BadOptionUsage":
        return UsageError("{option} has no value; expected one.", option=found.option_name)
    return UsageError("`{command}`: {found}", command=command, found=text)


def _words_of(context: Any) -> str:
    """Return the words that lead to a command, however the program itself was begun."""
    words: list[str] = []
    while context is not None and context.parent is not None:
        words, context = [str(context.info_name), *words], context.parent
    return " ".join(["racecraft", *words])


def _not_found(command: str, found: str, known: Sequence[str]) -> dict[str, Any]:
    """Return the fields of an error about an unknown name; long lists are left to `--help`."""
    is_near = difflib.get_close_matches(found.casefold(), [name.casefold() for name in known])
    hint: object = nearest(found, known) if is_near else Message("`{command} --help` lists all.", command=command)
    return {"command": command, "found": found, "expected": list(known), "hint": hint}


def _options(context: Any) -> list[str]:
    parameters = (one for one in context.command.get_params(context) if not getattr(one, "hidden", False))
    return [name for one in parameters for name in (*one.opts, *one.secondary_opts) if name.startswith("-")]


def _commands(context: Any) -> list[str]:
    return [name for name, one in context.command.commands.items() if not one.hidden]


def _typed_name(parameter: Any) -> str:
    """Return how a parameter is typed: "--track", or what `--help` calls an argument."""
    named = parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar
    return str(named or parameter.name.upper())
