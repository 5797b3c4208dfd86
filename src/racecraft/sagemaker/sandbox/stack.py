"""A template worked out for this machine: what is made, what is not and why, what is told. Begin with `plan`.

Buckets and notebooks are made; every other resource is listed as not here. Nothing is written by this module.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.sagemaker.cloudformation.functions import Functions, NotHereError
from racecraft.sagemaker.cloudformation.parameters import redact, resolve_parameters
from racecraft.sagemaker.cloudformation.source import At
from racecraft.sagemaker.cloudformation.template import Output, Resource, Template, read_template
from racecraft.sagemaker.session import ACCOUNT, REGION, ROLE

BUCKET_NAME = re.compile(r"[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]")
NOTEBOOK_NAME = re.compile(r"[A-Za-z0-9](?:-*[A-Za-z0-9]){0,62}")
NOTEBOOK_FILE = re.compile(r"[\w-]+\.ipynb")
STACK_NAME = re.compile(r"[A-Za-z][A-Za-z0-9-]{0,127}")
BUCKET, NOTEBOOK, ROLE_TYPE = "AWS::S3::Bucket", "AWS::SageMaker::NotebookInstance", "AWS::IAM::Role"
NAME_KEYS = {BUCKET: "BucketName", NOTEBOOK: "NotebookInstanceName"}
NOT_HERE = "not here"


class StackError(UserInputError):
    """A stack cannot be made of a template."""


@dataclass(frozen=True)
class SkippedResource:
    """What becomes of one resource."""

    resource: str
    """Its name in the template."""
    type: str
    made: str | None
    """What stands for it; None: nothing does."""
    why: str
    """Why nothing does; may be empty otherwise."""


@dataclass(frozen=True)
class StackOutput:
    """An output, worked out."""

    name: str
    value: str | None
    description: str
    rests_on: tuple[str, ...]
    """Resources in it that are not here; their names are made up."""
    why: str = ""
    """Why there is no value."""


@dataclass
class Plan:
    """A stack, before anything is written."""

    name: str
    template: Template
    parameters: Mapping[str, Any]
    """As they may be shown."""
    buckets: list[str] = field(default_factory=list)
    notebooks: list[str] = field(default_factory=list)
    notebook_files: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the .ipynb files that the start-up script of each fetches."""
    fates: list[SkippedResource] = field(default_factory=list)
    outputs: list[StackOutput] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def stack_name_of(path: Path) -> str:
    """Return what a stack is called after its template.

    >>> stack_name_of(Path("2024 deep_racer.yaml"))
    'stack-2024-deep-racer'
    """
    name = re.sub(r"[^A-Za-z0-9]+", "-", path.stem).strip("-") or "sandbox"
    return (name if name[0].isalpha() else f"stack-{name}")[:100]


def plan(path: str | Path, given: Mapping[str, str], name: str | None = None, region: str = REGION) -> Plan:
    """Read a template and work it out.

    Args:
        path: The template.
        given: Values of its parameters.
        name: The stack's; None: after the file.
        region: What AWS::Region is.

    Raises:
        TemplateError: The template cannot be used.
        ParameterError: A parameter is missing or not allowed.
        StackError: A name in it can be no bucket, notebook or stack.
    """
    template = read_template(path)
    name = name or stack_name_of(template.path)
    if not STACK_NAME.fullmatch(name):
        raise StackError(
            "--stack-name {name!r}: no name of a stack; expected a letter, then letters, digits and hyphens.", name=name
        )
    values = resolve_parameters(template, given)
    whole = Plan(name, template, redact(template, values))
    stack = _Stack(template, values, name, region, whole)
    stack.work_out()
    whole.outputs = [described for output in template.outputs.values() if (described := stack.told(output))]
    return whole


class _Stack:
    """The template of a plan, and what its resources are called."""

    def __init__(self, template: Template, values: Mapping[str, Any], name: str, region: str, whole: Plan) -> None:
        self._template, self._name, self._region, self._whole = template, name, region, whole
        pseudo = {
            "AWS::AccountId": ACCOUNT, "AWS::Region": region, "AWS::Partition": "aws", "AWS::NotificationARNs": [],
            "AWS::StackName": name, "AWS::URLSuffix": "amazonaws.com",
            "AWS::StackId": f"arn:aws:cloudformation:{region}:{ACCOUNT}:stack/{name}",
        }  # fmt: skip
        self._functions = Functions(template, {**values, **pseudo}, self)
        self._functions.notes = whole.notes
        self._names: dict[str, str | None] = {}
        self._touched: set[str] = set()

    def work_out(self) -> None:
        """Decide what becomes of every resource, in the template's order."""
        for resource in self._template.resources.values():
            if self._functions.holds(resource.condition):
                made, why = self._made_of(resource)
            else:
                made, why = None, f"condition {resource.condition} does not hold"
            self._whole.fates.append(SkippedResource(resource.name, resource.type, made, why))

    def told(self, output: Output) -> StackOutput | None:
        """Return an output worked out; None where its condition does not hold."""
        if not self._functions.holds(output.condition):
            return None
        self._touched.clear()
        try:
            value = self._functions.value(output.value, ("Outputs", output.name, "Value"))
        except NotHereError as reason:
            return StackOutput(output.name, None, output.description, (), str(reason))
        return StackOutput(output.name, str(value).strip(), output.description, tuple(sorted(self._touched)))

    def name_of(self, resource: str, at: At) -> str:
        """Return what `Ref` gives of a resource."""
        self._require_made(resource, at)
        kind = self._template.resources[resource].type
        if kind not in (BUCKET, NOTEBOOK, ROLE_TYPE):
            self._touched.add(resource)
        return self._physical(resource)

    def attribute_of(self, resource: str, attribute: str, at: At) -> str:
        """Return what `Fn::GetAtt` gives of a resource."""
        self._require_made(resource, at)
        kind, name = self._template.resources[resource].type, self._physical(resource)
        if kind == ROLE_TYPE and attribute == "Arn":
            return ROLE
        if kind == BUCKET and attribute == "Arn":
            return f"arn:aws:s3:::{name}"
        if kind == NOTEBOOK and attribute == "NotebookInstanceName":
            return name
        self._touched.add(resource)
        return f"arn:aws:{self._name}:{self._region}:{ACCOUNT}:{name}" if attribute == "Arn" else f"{name}.{attribute}"

    def _require_made(self, resource: str, at: At) -> None:
        if resource not in self._template.resources:
            known = [*self._template.parameters, *self._template.resources]
            self._template.source.refuse(
                at,
                Message("points to '{resource}', which is not there", resource=resource),
                "a parameter or a resource",
                nearest(resource, known),
            )
        condition = self._template.resources[resource].condition
        if not self._functions.holds(condition):
            self._template.source.refuse(
                at,
                Message(
                    "'{resource}', which is not made: condition {condition} does not hold",
                    resource=resource,
                    condition=condition,
                ),
                "a resource that is made",
                "Give the place that names it the same condition.",
            )

    def _physical(self, resource: str) -> str:
        """Return what a resource is called: as it says itself, else after the stack."""
        name = self._names.get(resource)
        if name is not None:
            return name
        found = self._template.resources[resource]
        key = NAME_KEYS.get(found.type)
        if resource in self._names:
            self._template.source.refuse(
                (*found.at, str(key)), "a name that waits for itself", "a name without a circle"
            )
        self._names[resource] = None
        if key is not None and key in found.properties:
            name = self._functions.text(found.properties[key], (*found.at, key))
        else:
            name = f"{self._name}-{resource}"
            name = name.lower() if found.type == BUCKET else name
        self._check_name(found, name, key)
        self._names[resource] = name
        return name

    def _check_name(self, resource: Resource, name: str, key: str | None) -> None:
        pattern = {BUCKET: BUCKET_NAME, NOTEBOOK: NOTEBOOK_NAME}.get(resource.type)
        if pattern is not None and (not pattern.fullmatch(name) or ".." in name):
            expected = (
                "3 to 63 of a-z, 0-9, '-' and '.'" if pattern is BUCKET_NAME else "at most 63 letters, digits, '-'"
            )
            self._template.source.refuse((*resource.at, str(key)), Message("the name {name!r}", name=name), expected)

    def _made_of(self, resource: Resource) -> tuple[str | None, str]:
        """Return what stands for a resource, and why nothing does."""
        if resource.type not in NAME_KEYS:
            return None, NOT_HERE
        try:
            name = self._physical(resource.name)
        except NotHereError as reason:
            return None, str(reason)
        kind = "bucket" if resource.type == BUCKET else "notebook"
        made = self._whole.buckets if resource.type == BUCKET else self._whole.notebooks
        if name in made:
            self._template.source.refuse(
                resource.at,
                Message("{kind} '{name}' stands twice", kind=kind, name=name),
                Message("one {kind} of a name", kind=kind),
            )
        made.append(name)
        if resource.type == NOTEBOOK:
            self._whole.notebook_files[name] = self._fetched_by(resource)
        return f"{kind} {name}", ""

    def _fetched_by(self, notebook: Resource) -> tuple[str, ...]:
        """Return the names of the notebooks in the start-up script that a notebook instance names."""
        named = json.dumps(notebook.properties.get("LifecycleConfigName"), default=str)
        scripts = [one for name, one in self._template.resources.items() if re.search(rf"\b{re.escape(name)}\b", named)]
        text = " ".join(json.dumps(one.properties, default=str) for one in scripts)
        return tuple(dict.fromkeys(NOTEBOOK_FILE.findall(text)))
