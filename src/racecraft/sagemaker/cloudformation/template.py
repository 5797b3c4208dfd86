"""A template's sections, each part by its name. Begin with `read_template`.

Reading refuses unknown sections and resources without a type.

Source: CloudFormation's user guide, "Template anatomy".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import nearest
from racecraft.sagemaker.cloudformation.source import At, Source, TemplateError, read_source

__all__ = ["Output", "Resource", "Template", "TemplateError", "read_template"]

SECTIONS = (
    "AWSTemplateFormatVersion", "Description", "Metadata", "Parameters", "Rules", "Mappings", "Conditions", "Transform",
    "Resources", "Outputs", "Hooks",
)  # fmt: skip


@dataclass(frozen=True)
class Resource:
    """One thing that the template asks for."""

    name: str
    type: str
    properties: Mapping[str, Any]
    condition: str | None
    """It is made where this condition holds; None: always."""

    @property
    def at(self) -> At:
        """Where its properties stand."""
        return ("Resources", self.name, "Properties")


@dataclass(frozen=True)
class Output:
    """One thing that is told when everything stands."""

    name: str
    value: Any
    description: str
    condition: str | None


@dataclass(frozen=True)
class Template:
    """A template, functions not yet worked out."""

    source: Source
    description: str
    parameters: Mapping[str, Mapping[str, Any]]
    mappings: Mapping[str, Mapping[str, Any]]
    conditions: Mapping[str, Any]
    resources: Mapping[str, Resource]
    outputs: Mapping[str, Output]

    @property
    def path(self) -> Path:
        """Where it was read."""
        return self.source.path


def read_template(path: str | Path) -> Template:
    """Read a template, YAML or JSON.

    Raises:
        TemplateError: It cannot be read or used; file, line and key are named.
    """
    source = read_source(path)
    top = source.values
    if not isinstance(top, dict) or "Resources" not in top:
        source.refuse((), "no group `Resources`", "a CloudFormation template")
    for name in top:
        if name not in SECTIONS:
            source.refuse((name,), "an unknown section", "a section of a template", nearest(name, SECTIONS))
    template = Template(
        source,
        str(top.get("Description") or "").strip(),
        _groups(source, top, "Parameters"),
        _groups(source, top, "Mappings"),
        _group(source, top.get("Conditions"), ("Conditions",)),
        {name: _resource(source, name, part) for name, part in _groups(source, top, "Resources").items()},
        {name: _output(source, name, part) for name, part in _groups(source, top, "Outputs").items()},
    )
    if not template.resources:
        source.refuse(("Resources",), "nothing", "at least one resource")
    return template


def _resource(source: Source, name: str, part: Mapping[str, Any]) -> Resource:
    at = ("Resources", name)
    if not isinstance(part.get("Type"), str):
        source.refuse(at, "no `Type`", "a resource's type such as AWS::S3::Bucket")
    properties = _group(source, part.get("Properties"), (*at, "Properties"))
    return Resource(name, part["Type"], properties, _word(source, part.get("Condition"), (*at, "Condition")))


def _output(source: Source, name: str, part: Mapping[str, Any]) -> Output:
    at = ("Outputs", name)
    if "Value" not in part:
        source.refuse(at, "no `Value`", "what the output tells")
    description = str(part.get("Description") or "").strip()
    return Output(name, part["Value"], description, _word(source, part.get("Condition"), (*at, "Condition")))


def _groups(source: Source, top: Mapping[str, Any], section: str) -> dict[str, dict[str, Any]]:
    named = _group(source, top.get(section), (section,))
    return {name: _group(source, part, (section, name)) for name, part in named.items()}


def _group(source: Source, value: Any, at: At) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict):
        source.refuse(at, "a list" if isinstance(value, list) else repr(value), "a group of keys")
    return value


def _word(source: Source, value: Any, at: At) -> str | None:
    if value is not None and not isinstance(value, str):
        source.refuse(at, "no word", "the name of a condition")
    return value
