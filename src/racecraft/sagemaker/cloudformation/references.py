"""Every name that a template points to is there, and nothing waits for itself. Begin with `check_references`.

All of a template is looked at, what is never made included, as CloudFormation does before it begins.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import nearest
from racecraft.sagemaker.cloudformation.source import At, Source

PSEUDO_PARAMETERS = (
    "AWS::AccountId", "AWS::NoValue", "AWS::NotificationARNs", "AWS::Partition", "AWS::Region", "AWS::StackId",
    "AWS::StackName", "AWS::URLSuffix",
)  # fmt: skip
PLACEHOLDER = re.compile(r"\$\{([^!}][^}]*)\}")
"""A name in the text of Fn::Sub; `${!Literal}` is none."""


@dataclass(frozen=True)
class Pointer:
    """One place that names something else."""

    name: str
    kind: str
    """`value` (parameter or resource), `attribute` (resource), `condition` or `mapping`."""
    at: At


def pointers(value: Any, at: At) -> Iterator[Pointer]:
    """Yield what a value points to, however deep."""
    if isinstance(value, list):
        for place, part in enumerate(value):
            yield from pointers(part, (*at, str(place)))
    if not isinstance(value, dict):
        return
    if len(value) == 1:
        yield from _of_function(*next(iter(value.items())), at)
    for key, part in value.items():
        yield from pointers(part, (*at, key))


def _of_function(name: str, inside: Any, at: At) -> Iterator[Pointer]:
    here = (*at, name)
    first = inside[0] if isinstance(inside, list) and inside else None
    if name == "Ref" and isinstance(inside, str):
        yield Pointer(inside, "value", here)
    elif name == "Fn::GetAtt" and isinstance(first, str):
        yield Pointer(first, "attribute", here)
    elif name == "Fn::GetAtt" and isinstance(inside, str):
        yield Pointer(inside.split(".")[0], "attribute", here)
    elif name == "Fn::Sub":
        yield from _of_text(inside, here)
    elif name == "Fn::If" and isinstance(first, str):
        yield Pointer(first, "condition", here)
    elif name == "Condition" and isinstance(inside, str) and at[0] == "Conditions":
        yield Pointer(inside, "condition", here)
    elif name == "Fn::FindInMap" and isinstance(first, str):
        yield Pointer(first, "mapping", here)


def _of_text(inside: Any, at: At) -> Iterator[Pointer]:
    text, own = (inside[0], inside[1]) if isinstance(inside, list) and len(inside) == 2 else (inside, {})
    for found in PLACEHOLDER.findall(text) if isinstance(text, str) else ():
        name = found.strip()
        if not (isinstance(own, dict) and name in own):
            yield Pointer(name.split(".")[0], "attribute" if "." in name else "value", at)


def check_references(source: Source) -> None:
    """Refuse what points to nothing, and circles.

    Raises:
        TemplateError: With the line of the place that points.
    """
    top: Mapping[str, Any] = source.values
    parts = {name: list(top.get(name) or {}) for name in ("Parameters", "Resources", "Conditions", "Mappings")}
    known = {
        "value": [*parts["Parameters"], *parts["Resources"], *PSEUDO_PARAMETERS],
        "attribute": parts["Resources"],
        "condition": parts["Conditions"],
        "mapping": parts["Mappings"],
    }
    expected = {
        "value": "a parameter or a resource", "attribute": "a resource", "condition": "a condition",
        "mapping": "a mapping",
    }  # fmt: skip
    waits: dict[str, dict[str, dict[str, At]]] = {"Resources": {}, "Conditions": {}}
    for section in ("Conditions", "Resources", "Outputs"):
        for name, part in (top.get(section) or {}).items():
            found = [*pointers(part, (section, name)), *_attached(part, (section, name))]
            for pointer in found:
                if pointer.name not in known[pointer.kind]:
                    source.refuse(
                        pointer.at, f"points to '{pointer.name}', which is not there",
                        f"{expected[pointer.kind]} of this template", nearest(pointer.name, known[pointer.kind]),
                    )  # fmt: skip
            if section in waits:
                waits[section][name] = {
                    one.name: one.at
                    for one in found  # a parameter, a condition and a resource may have one name
                    if one.name in parts[section] and (one.kind == "condition") == (section == "Conditions")
                }
    for section, graph in waits.items():
        _refuse_circles(source, section, graph)


def _attached(part: Any, at: At) -> Iterator[Pointer]:
    """Yield what a resource or an output names beside its values: what it waits for, and its condition."""
    if not isinstance(part, dict) or at[0] == "Conditions":
        return
    if isinstance(part.get("Condition"), str):
        yield Pointer(part["Condition"], "condition", (*at, "Condition"))
    waits = part.get("DependsOn") or []
    for name in [waits] if isinstance(waits, str) else waits:
        yield Pointer(str(name), "attribute", (*at, "DependsOn"))


def _refuse_circles(source: Source, section: str, graph: Mapping[str, Mapping[str, At]]) -> None:
    done: set[str] = set()
    for start in graph:
        way: list[str] = []
        ahead: list[Iterator[str]] = [iter((start,))]
        while ahead:
            name = next(ahead[-1], None)
            if name is None:
                ahead.pop()
                if way:
                    done.add(way.pop())
            elif name in way:
                circle = [*way[way.index(name) :], name]
                source.refuse(
                    graph[way[-1]][name], f"waits for itself: {' → '.join(circle)}", "references without a circle",
                )  # fmt: skip
            elif name not in done:
                way.append(name)
                ahead.append(iter(graph[name]))
