"""`racecraft schema`: the JSON Schema of every command, for programs that call racecraft. Begin with `schemas`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Action, action
from racecraft.cli.from_request import command
from racecraft.cli.output import print_json
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.json_schema import DIALECT, request_schema, result_schema
from racecraft.settings.request import Request, argument

if TYPE_CHECKING:
    import typer

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


@dataclass(frozen=True, kw_only=True)
class SchemaRequest(Request):
    """Which commands are described."""

    words: tuple[str, ...] = argument("Only this command, such as: snakes play.", (), metavar="[COMMAND…]")


@dataclass(frozen=True)
class Schemas:
    """JSON Schema of commands."""

    commands: dict[str, Any]
    """Request and result by the words that are typed."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the commands, and what is printed where one fails."""
        return {"$schema": DIALECT, "commands": self.commands, "error": ERROR}


@action
def describe_commands(request: SchemaRequest, progress: Progress = quiet) -> Schemas:
    """Print the JSON Schema of commands: what each takes, by name, and what it prints with --json.

    Examples:

        racecraft schema checkpoints

        racecraft schema snakes play
    """
    from racecraft.cli.table import app_for
    from racecraft.contract.errors import SettingError, nearest

    name = " ".join(request.words)
    found = schemas(app_for(list(request.words)))
    chosen = {key: value for key, value in found.items() if not name or f"{key} ".startswith(f"{name} ")}
    if not chosen:
        hint = nearest(name, found)
        raise SettingError("'{name}' is no command that has a schema. {hint}", name=name, hint=hint)
    return Schemas(chosen)


schema = command(describe_commands, print_json)


def schemas(app: typer.Typer) -> dict[str, dict[str, Any]]:
    """Return request and result of every command that is made from an action, by the words that are typed."""
    return {
        name: {"request": request_schema(action.request), "result": result_schema(action.results)}
        for name, action in _actions(app, "")
    }


def _actions(app: typer.Typer, before: str) -> Iterator[tuple[str, Action[Any]]]:
    for one in app.registered_commands:
        made_from = getattr(one.callback, "action", None)
        if made_from is not None and not one.hidden:
            yield f"{before}{one.name or one.callback.__name__.replace('_', '-')}", made_from  # type: ignore[union-attr]
    for group in app.registered_groups:
        if group.typer_instance is not None:
            yield from _actions(group.typer_instance, f"{before}{group.name} ")
