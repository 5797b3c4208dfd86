"""`racecraft schema`: the JSON Schema of every command, for programs that call racecraft. Begin with `schemas`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import typer

from racecraft.actions.action import Action
from racecraft.settings.json_schema import DIALECT, request_schema, result_schema

ERROR = {
    "type": "object",
    "description": "What --json prints where a command fails; exit code 2: what was given cannot be used, 1: else.",
    "properties": {
        "error": {
            "type": "object",
            "properties": {
                "kind": {"type": "string", "description": "Class of the error, such as SettingError."},
                "message": {"type": "string", "description": "What was found, what is expected, what to do."},
                "template": {"type": "string", "description": "The message with names in place of its fields."},
                "fields": {"type": "object", "description": "What stands in the template, by name."},
            },
            "required": ["kind", "message"],
        }
    },
    "required": ["error"],
}


def schema(
    words: Annotated[
        list[str] | None, typer.Argument(metavar="[COMMAND…]", help="Only this command, such as: snakes play.")
    ] = None,
) -> None:
    """Print the JSON Schema of commands: what each takes, by name, and what it prints with --json.

    Examples:

        racecraft schema checkpoints

        racecraft schema snakes play
    """
    from racecraft.cli.output import print_json
    from racecraft.cli.table import app_for
    from racecraft.contract.errors import SettingError, nearest

    name = " ".join(words or ())
    found = schemas(app_for(words or []))
    chosen = {key: value for key, value in found.items() if not name or f"{key} ".startswith(f"{name} ")}
    if not chosen:
        hint = nearest(name, found)
        raise SettingError("'{name}' is no command that has a schema. {hint}", name=name, hint=hint)
    print_json({"$schema": DIALECT, "commands": chosen, "error": ERROR})


def schemas(app: typer.Typer) -> dict[str, dict[str, Any]]:
    """Return request and result of every command that is made from an action, by the words that are typed."""
    return {
        name: {"request": request_schema(action.request), "result": result_schema(action.results)}
        for name, action in _actions(app, "")
    }


def _actions(app: typer.Typer, before: str) -> Iterator[tuple[str, Action[Any]]]:
    for command in app.registered_commands:
        action = getattr(command.callback, "action", None)
        if action is not None and not command.hidden:
            yield f"{before}{command.name or command.callback.__name__.replace('_', '-')}", action  # type: ignore[union-attr]
    for group in app.registered_groups:
        if group.typer_instance is not None:
            yield from _actions(group.typer_instance, f"{before}{group.name} ")
