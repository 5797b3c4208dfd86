"""A template's parameters: what was given, what stands in for the rest, and what each allows.

Begin with `resolve_parameters`.

Source: CloudFormation's user guide, "Parameters".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.sagemaker.cloudformation.source import At
from racecraft.sagemaker.cloudformation.template import Template

HIDDEN = "****"


class ParameterError(UserInputError):
    """A parameter's value is missing or not allowed."""


def resolve_parameters(template: Template, given: Mapping[str, str]) -> dict[str, Any]:
    """Return every parameter's value; lists (CommaDelimitedList, List<…>) as lists.

    Args:
        template: Says which there are.
        given: Values by name.

    Raises:
        ParameterError: One is missing, unknown or not allowed.
        TemplateError: A declaration cannot be used.
    """
    for name in given:
        if name not in template.parameters:
            known = nearest(name, template.parameters) if template.parameters else "It has none."
            raise ParameterError(
                "--parameter {name}: {path} has no such parameter. {known}", name=name, path=template.path, known=known
            )
    missing = [
        name for name, parameter in template.parameters.items() if name not in given and "Default" not in parameter
    ]
    if missing:
        words = " ".join(f"--parameter {name}=…" for name in missing)
        raise ParameterError(
            "{path}: {missing}: no value and no default; expected one for each. Add {words}",
            path=template.path,
            missing=", ".join(missing),
            words=words,
        )
    return {name: _value(template, name, parameter, given) for name, parameter in template.parameters.items()}


def redact(template: Template, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values as they may be printed and kept: what the template calls NoEcho is hidden."""
    hidden = {name for name, parameter in template.parameters.items() if parameter.get("NoEcho") == "true"}
    return {name: HIDDEN if name in hidden else value for name, value in values.items()}


def _value(template: Template, name: str, parameter: Mapping[str, Any], given: Mapping[str, str]) -> Any:
    at: At = ("Parameters", name)
    kind = parameter.get("Type")
    if not isinstance(kind, str):
        template.source.refuse(at, "no `Type`", "a parameter's type such as String")
    value = given[name] if name in given else parameter["Default"]
    if not isinstance(value, str):
        template.source.refuse((*at, "Default"), "no word", "a word or a number")
    is_list = kind == "CommaDelimitedList" or kind.startswith("List<")
    parts = [part.strip() for part in value.split(",")] if is_list else [value]
    checked = [_allowed(template, name, parameter, part) for part in parts]
    return checked if is_list else checked[0]


def _allowed(template: Template, name: str, parameter: Mapping[str, Any], value: str) -> str:
    """Return a value that is among AllowedValues; other limits are not checked, since nothing is deployed.

    Raises:
        ParameterError: It is not.
    """
    allowed = parameter.get("AllowedValues")
    if not isinstance(allowed, list) or value in allowed:
        return value
    if value.lower() in ("true", "false") and value.lower() in allowed:
        return value.lower()  # YAML's True and the word "True" are one to whoever types it
    raise _refusal(template, name, parameter, value, f"one of {', '.join(map(str, allowed))}")


def _refusal(template: Template, name: str, parameter: Mapping[str, Any], value: str, expected: str) -> ParameterError:
    shown_value = HIDDEN if parameter.get("NoEcho") == "true" else repr(value)
    why = str(parameter.get("ConstraintDescription") or "").strip()
    message = f"{template.path}: parameter {name} is {shown_value}; expected {expected}. Give --parameter {name}=…"
    return ParameterError(Message("{letter} ({why})", letter=message, why=why) if why else message)
