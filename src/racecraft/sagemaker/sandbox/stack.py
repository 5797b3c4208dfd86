"""A template worked out for this machine: what is made, what is not and why, what is told. Begin with `plan`.

Nothing is written here. A nested stack (AWS::CloudFormation::Stack) is followed where its template lies beside the one
that names it, under the last part of its TemplateURL.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

from racecraft.contract.errors import UserInputError
from racecraft.sagemaker.cloudformation.functions import Functions, NotHereError
from racecraft.sagemaker.cloudformation.parameters import settled, shown
from racecraft.sagemaker.cloudformation.source import At
from racecraft.sagemaker.cloudformation.start_script import StartScript, read_start_script
from racecraft.sagemaker.cloudformation.template import Output, Resource, Template, read_template
from racecraft.sagemaker.sandbox.fates import BUCKET, NOTEBOOK, ROLE_TYPE, STACK, START_SCRIPTS, reason_for
from racecraft.sagemaker.session import ACCOUNT, REGION, ROLE

BUCKET_NAME = re.compile(r"[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]")
NOTEBOOK_NAME = re.compile(r"[A-Za-z0-9](?:-*[A-Za-z0-9]){0,62}")
STACK_NAME = re.compile(r"[A-Za-z][A-Za-z0-9-]{0,127}")
NAME_KEYS = {
    BUCKET: "BucketName", NOTEBOOK: "NotebookInstanceName", START_SCRIPTS: "NotebookInstanceLifecycleConfigName",
}  # fmt: skip
DEEPEST = 5


class StackError(UserInputError):
    """A stack cannot be made of a template."""


@dataclass(frozen=True)
class Fate:
    """What becomes of one resource."""

    resource: str
    """Its name in the template; of a nested one `Stack.Name`."""
    type: str
    made: str | None
    """What stands for it; None: nothing does."""
    why: str
    """Why nothing does; may be empty otherwise."""


@dataclass(frozen=True)
class Notebook:
    """A notebook instance: a folder, and what its start-up scripts lay into it."""

    name: str
    scripts: tuple[StartScript, ...]


@dataclass(frozen=True)
class Told:
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
    """A stack, nested ones in it, before anything is written."""

    name: str
    template: Template
    parameters: Mapping[str, Any]
    """As they may be shown."""
    buckets: list[str] = field(default_factory=list)
    notebooks: list[Notebook] = field(default_factory=list)
    fates: list[Fate] = field(default_factory=list)
    outputs: list[Told] = field(default_factory=list)
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
        TemplateError: The template, or a nested one, cannot be used.
        ParameterError: A parameter is missing or not allowed.
        StackError: A name in it can be no bucket, notebook or stack.
        MissingExtraError: PyYAML is not installed.
    """
    template = read_template(path)
    name = name or stack_name_of(template.path)
    if not STACK_NAME.fullmatch(name):
        raise StackError(
            f"--stack-name {name!r}: no name of a stack; expected a letter, then letters, digits and hyphens."
        )
    values = settled(template, given)
    whole = Plan(name, template, shown(template, values))
    stack = _Stack(template, values, name, region, whole, (), ())
    stack.work_out()
    whole.outputs = [told for output in template.outputs.values() if (told := stack.told(output))]
    return whole


class _Stack:
    """One template of the plan, and what its resources are called."""

    def __init__(
        self,
        template: Template,
        values: Mapping[str, Any],
        name: str,
        region: str,
        whole: Plan,
        above: tuple[str, ...],
        chain: tuple[Path, ...],
    ) -> None:
        self._template, self._name, self._region, self._whole, self._above = template, name, region, whole, above
        self._chain = (*chain, template.path.resolve())
        pseudo = {
            "AWS::AccountId": ACCOUNT, "AWS::Region": region, "AWS::Partition": "aws", "AWS::NotificationARNs": [],
            "AWS::StackName": name, "AWS::URLSuffix": "amazonaws.com",
            "AWS::StackId": f"arn:aws:cloudformation:{region}:{ACCOUNT}:stack/{name}",
        }  # fmt: skip
        self._functions = Functions(template, {**values, **pseudo}, self)
        self._functions.notes = whole.notes
        self._names: dict[str, str] = {}
        self._nested: dict[str, _Stack | None] = {}
        self._touched: set[str] = set()

    def work_out(self) -> None:
        """Decide what becomes of every resource, in the template's order."""
        for resource in self._template.resources.values():
            shown_name = ".".join((*self._above, resource.name))
            if not self._functions.holds(resource.condition):
                why = f"condition {resource.condition} does not hold"
                self._whole.fates.append(Fate(shown_name, resource.type, None, why))
                continue
            made, why = self._made_of(resource)
            self._whole.fates.append(Fate(shown_name, resource.type, made, why))
            if resource.type == STACK:
                nested = self._nested_stack(resource.name)
                if nested is not None:
                    nested.work_out()

    def told(self, output: Output) -> Told | None:
        """Return an output worked out; None where its condition does not hold."""
        if not self._functions.holds(output.condition):
            return None
        self._touched.clear()
        try:
            value = self._functions.value(output.value, ("Outputs", output.name, "Value"))
        except NotHereError as reason:
            return Told(output.name, None, output.description, (), str(reason))
        return Told(output.name, str(value).strip(), output.description, tuple(sorted(self._touched)))

    def name_of(self, resource: str, at: At) -> str:
        """Return what `Ref` gives of a resource."""
        self._require_made(resource, at)
        kind = self._template.resources[resource].type
        if kind not in (BUCKET, NOTEBOOK, START_SCRIPTS, ROLE_TYPE, STACK):
            self._touched.add(".".join((*self._above, resource)))
        return self._physical(resource)

    def attribute_of(self, resource: str, attribute: str, at: At) -> str:
        """Return what `Fn::GetAtt` gives of a resource."""
        self._require_made(resource, at)
        kind, name = self._template.resources[resource].type, self._physical(resource)
        if kind == STACK and attribute.startswith("Outputs."):
            return self._output_of(resource, attribute.removeprefix("Outputs."), at)
        if kind == ROLE_TYPE and attribute == "Arn":
            return ROLE
        if kind == BUCKET and attribute == "Arn":
            return f"arn:aws:s3:::{name}"
        if kind in (NOTEBOOK, START_SCRIPTS) and attribute == f"{kind.rpartition('::')[2]}Name":
            return name
        self._touched.add(".".join((*self._above, resource)))
        return f"arn:aws:{self._name}:{self._region}:{ACCOUNT}:{name}" if attribute == "Arn" else f"{name}.{attribute}"

    def _require_made(self, resource: str, at: At) -> None:
        condition = self._template.resources[resource].condition
        if not self._functions.holds(condition):
            self._template.source.refuse(
                at, f"'{resource}', which is not made: condition {condition} does not hold", "a resource that is made",
                "Give the place that names it the same condition.",
            )  # fmt: skip

    def _physical(self, resource: str) -> str:
        """Return what a resource is called: as it says itself, else after the stack."""
        if resource not in self._names:
            found = self._template.resources[resource]
            key = NAME_KEYS.get(found.type)
            if key is not None and key in found.properties:
                name = self._functions.text(found.properties[key], (*found.at, key))
            else:
                name = f"{self._name}-{resource}"
                name = name.lower() if found.type == BUCKET else name
            self._check_name(found, name, key)
            self._names[resource] = name
        return self._names[resource]

    def _check_name(self, resource: Resource, name: str, key: str | None) -> None:
        pattern = {BUCKET: BUCKET_NAME, NOTEBOOK: NOTEBOOK_NAME}.get(resource.type)
        if pattern is not None and (not pattern.fullmatch(name) or ".." in name):
            expected = (
                "3 to 63 of a-z, 0-9, '-' and '.'" if pattern is BUCKET_NAME else "at most 63 letters, digits, '-'"
            )
            self._template.source.refuse((*resource.at, str(key)), f"the name {name!r}", expected)

    def _made_of(self, resource: Resource) -> tuple[str | None, str]:
        """Return what stands for a resource, and why nothing does."""
        if resource.type == BUCKET:
            name = self._physical(resource.name)
            if name in self._whole.buckets:
                self._template.source.refuse(resource.at, f"bucket '{name}' stands twice", "one bucket of a name")
            self._whole.buckets.append(name)
            return f"bucket {name}", ""
        if resource.type == NOTEBOOK:
            name = self._physical(resource.name)
            if any(name == one.name for one in self._whole.notebooks):
                self._template.source.refuse(resource.at, f"notebook '{name}' stands twice", "one of a name")
            self._whole.notebooks.append(Notebook(name, self._scripts_of(resource)))
            return f"notebook folder {name}", ""
        if resource.type == START_SCRIPTS:
            return "files of the notebook's folder", "its scripts are read and not run"
        if resource.type == STACK:
            nested = self._nested_stack(resource.name)
            if nested is not None:
                return f"what {nested._template.path.name} asks for", ""
            return None, f"its template does not lie beside {self._template.path.name}: {self._url(resource)}"
        return None, reason_for(resource.type)

    def _scripts_of(self, resource: Resource) -> tuple[StartScript, ...]:
        """Return what a notebook's life-cycle configuration runs: when it is made, then whenever it starts."""
        if "LifecycleConfigName" not in resource.properties:
            return ()
        named = self._functions.text(resource.properties["LifecycleConfigName"], (*resource.at, "LifecycleConfigName"))
        for config in self._template.resources.values():
            is_made = config.type == START_SCRIPTS and self._functions.holds(config.condition)
            if is_made and self._physical(config.name) == named:
                return tuple(
                    read_start_script(text) for key in ("OnCreate", "OnStart") for text in self._contents(config, key)
                )
        return ()

    def _contents(self, config: Resource, key: str) -> list[str]:
        hooks = config.properties.get(key) or []
        if not isinstance(hooks, list):
            self._template.source.refuse((*config.at, key), "no list", "a list of scripts")
        found = []
        for place, hook in enumerate(hooks):
            at = (*config.at, key, str(place), "Content")
            if not isinstance(hook, dict) or "Content" not in hook:
                self._template.source.refuse(at, "no `Content`", "a script")
            found.append(self._functions.text(hook["Content"], at))
        return found

    def _url(self, resource: Resource) -> str:
        at = (*resource.at, "TemplateURL")
        if "TemplateURL" not in resource.properties:
            self._template.source.refuse(resource.at, "no `TemplateURL`", "where the nested template lies")
        return self._functions.text(resource.properties["TemplateURL"], at)

    def _nested_stack(self, name: str) -> _Stack | None:
        """Return a nested stack; None where its template does not lie beside this one."""
        if name not in self._nested:
            self._nested[name] = self._opened(self._template.resources[name])
        return self._nested[name]

    def _opened(self, resource: Resource) -> _Stack | None:
        path = self._template.path.parent / Path(urlparse(self._url(resource)).path).name
        if not path.is_file():
            return None
        if path.resolve() in self._chain or len(self._chain) >= DEEPEST:
            self._template.source.refuse(
                resource.at, f"{path.name} nests itself", f"at most {DEEPEST} levels of stacks"
            )
        template = read_template(path)
        said = resource.properties.get("Parameters") or {}
        given = self._functions.value(said, (*resource.at, "Parameters"))
        words = {key: ",".join(part) if isinstance(part, list) else str(part) for key, part in given.items()}
        above = (*self._above, resource.name)
        name = f"{self._name}-{resource.name}"
        return _Stack(template, settled(template, words), name, self._region, self._whole, above, self._chain)

    def _output_of(self, resource: str, output: str, at: At) -> str:
        nested = self._nested_stack(resource)
        if nested is None:
            raise NotHereError(f"{resource}'s template does not lie beside {self._template.path.name}")
        found = nested._template.outputs.get(output)
        told = nested.told(found) if found is not None else None
        if told is None:
            self._template.source.refuse(
                at, f"'{output}', no output of {nested._template.path.name}", "one of its outputs"
            )
        if told.value is None:
            raise NotHereError(told.why)
        self._touched.update(told.rests_on)
        return told.value
