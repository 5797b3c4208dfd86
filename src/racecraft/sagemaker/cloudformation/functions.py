"""CloudFormation's functions, worked out as plain values. Begin with `Functions.value`.

    Ref  Fn::GetAtt  Fn::Sub  Fn::Join  Fn::FindInMap  Fn::If
    in conditions: Fn::Equals  Fn::And  Fn::Or  Fn::Not  Condition

Other functions of CloudFormation raise `NotHereError`: names of buckets and notebooks and the outputs need none.

Source: CloudFormation's reference, "Intrinsic function reference".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NoReturn, Protocol

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.sagemaker.cloudformation.source import At
from racecraft.sagemaker.cloudformation.template import Template

NO_VALUE = object()
"""What `!Ref AWS::NoValue` is: its key or place is left out."""
STAND_IN_REGION = "us-east-1"
"""Whose row of a mapping is taken where this machine's region has none."""
PLACEHOLDER = re.compile(r"\$\{([^!}][^}]*)\}")
"""A name in the text of Fn::Sub; `${!Literal}` is none."""


class NotHereError(UserInputError):
    """A value needs a function that is not here; the message is the reason alone."""


class Resolver(Protocol):
    """Knows what resources are called once they stand."""

    def name_of(self, resource: str, at: At) -> str:
        """Return what `Ref` gives of a resource."""
        ...

    def attribute_of(self, resource: str, attribute: str, at: At) -> str:
        """Return what `Fn::GetAtt` gives of it."""
        ...


class Functions:
    """Works out a template's values.

    Args:
        template: Where they stand.
        parameters: Values of parameters and pseudo parameters, by name.
        resolver: Knows the resources.
    """

    def __init__(self, template: Template, parameters: Mapping[str, Any], resolver: Resolver) -> None:
        self._template, self._resolver = template, resolver
        self._parameters = {**parameters, "AWS::NoValue": NO_VALUE}
        self._conditions: dict[str, bool] = {}
        self._waiting: set[str] = set()
        self.notes: list[str] = []
        """What stands in for something else, a clause each."""

    def value(self, value: Any, at: At) -> Any:
        """Return a value with every function in it worked out.

        Raises:
            TemplateError: A function is unknown or given what it cannot use.
            NotHereError: It rests on something that only the cloud has.
        """
        if isinstance(value, list):
            parts = [self.value(part, (*at, str(place))) for place, part in enumerate(value)]
            return [part for part in parts if part is not NO_VALUE]
        if not isinstance(value, dict):
            return value
        if len(value) == 1:
            ((name, inside),) = value.items()
            is_condition = name == "Condition" and isinstance(inside, str)
            if is_condition or name == "Ref" or name.startswith("Fn::"):
                return self._function(name, inside, (*at, name))
        worked = {key: self.value(part, (*at, key)) for key, part in value.items()}
        return {key: part for key, part in worked.items() if part is not NO_VALUE}

    def text(self, value: Any, at: At) -> str:
        """Return a value that must come to a word.

        Raises:
            TemplateError: It does not.
            NotHereError: It rests on something that only the cloud has.
        """
        worked = self.value(value, at)
        if not isinstance(worked, str):
            self._refuse(at, _kind(worked), "a word")
        return str(worked)

    def holds(self, condition: str | None) -> bool:
        """Return whether a condition holds; None always does."""
        if condition is None:
            return True
        if condition not in self._conditions:
            at = ("Conditions", condition)
            value = self._template.conditions.get(condition)
            if value is None or condition in self._waiting:
                why = "a condition that is not there" if value is None else "a condition that waits for itself"
                self._refuse(at, why, "a condition of this template", nearest(condition, self._template.conditions))
            self._waiting.add(condition)
            self._conditions[condition] = self._truth(value, at)
        return self._conditions[condition]

    def _function(self, name: str, inside: Any, at: At) -> Any:
        function = _FUNCTIONS.get(name)
        if function is None:
            self._refuse(at, "an unknown function", "a function of CloudFormation", nearest(name, _FUNCTIONS))
        return function(self, inside, at)

    def _ref(self, inside: Any, at: At) -> Any:
        name = self._name(inside, at)
        return self._parameters[name] if name in self._parameters else self._resolver.name_of(name, at)

    def _get_att(self, inside: Any, at: At) -> str:
        parts = inside.split(".", 1) if isinstance(inside, str) else inside
        if not isinstance(parts, list) or len(parts) != 2:
            self._refuse(at, _kind(inside), "a resource and an attribute")
        return self._resolver.attribute_of(self._name(parts[0], at), self.text(parts[1], (*at, "1")), at)

    def _sub(self, inside: Any, at: At) -> str:
        text, own = inside, {}
        if isinstance(inside, list):
            text, own = self._parts(inside, 2, at)
        if not isinstance(text, str) or not isinstance(own, dict):
            self._refuse(at, _kind(inside), "a text, or a text and a group of names")

        def filled(name: str) -> str:
            if name in own:
                return self.text(own[name], (*at, "1", name))
            return self.text({"Fn::GetAtt": name} if "." in name else {"Ref": name}, at)

        return PLACEHOLDER.sub(lambda found: filled(found[1].strip()), text).replace("${!", "${")

    def _join(self, inside: Any, at: At) -> str:
        between, parts = self._parts(inside, 2, at)
        words = self.value(parts, (*at, "1"))
        if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
            self._refuse((*at, "1"), _kind(words), "a list of words")
        return self.text(between, (*at, "0")).join(words)

    def _find_in_map(self, inside: Any, at: At) -> Any:
        names = [self.text(part, (*at, str(place))) for place, part in enumerate(self._parts(inside, 3, at))]
        rows = self._template.mappings.get(names[0])
        if rows is None:
            self._refuse(
                (*at, "0"),
                Message("'{names}'", names=names[0]),
                "a mapping",
                nearest(names[0], self._template.mappings),
            )
        row = rows.get(names[1])
        if row is None and names[1] == self._parameters["AWS::Region"] and STAND_IN_REGION in rows:
            row = rows[STAND_IN_REGION]
            note = f"mapping {names[0]} has no region '{names[1]}'; its row {STAND_IN_REGION} is taken"
            self.notes += [] if note in self.notes else [note]
        if row is None:
            self._refuse(
                (*at, "1"),
                Message("'{names}'", names=names[1]),
                Message("a row of {names}", names=names[0]),
                nearest(names[1], rows),
            )
        columns = row if isinstance(row, dict) else {}
        if names[2] not in columns:
            self._refuse(
                (*at, "2"),
                Message("'{names}'", names=names[2]),
                Message("a column of {names}", names=names[0]),
                nearest(names[2], columns),
            )
        return columns[names[2]]

    def _if(self, inside: Any, at: At) -> Any:
        condition, then, otherwise = self._parts(inside, 3, at)
        holds = self.holds(self._name(condition, at))
        return self.value(then if holds else otherwise, (*at, "1" if holds else "2"))

    def _not(self, inside: Any, at: At) -> bool:
        return not self._truth(self._parts(inside, 1, at)[0], (*at, "0"))

    def _any_or_all(self, inside: Any, at: At) -> bool:
        if not isinstance(inside, list) or not 2 <= len(inside) <= 10:
            self._refuse(at, _kind(inside), "two to ten conditions")
        each = [self._truth(part, (*at, str(place))) for place, part in enumerate(inside)]
        return all(each) if at[-1] == "Fn::And" else any(each)

    def _equals(self, inside: Any, at: At) -> bool:
        one, other = self._parts(inside, 2, at)
        return bool(self.value(one, (*at, "0")) == self.value(other, (*at, "1")))

    def _condition(self, inside: Any, at: At) -> bool:
        return self.holds(self._name(inside, at))

    def _not_here(self, inside: Any, at: At) -> Any:
        place = f"{self._template.path}:{self._template.source.line(at)}"
        raise NotHereError("{place}: {at} is not here", place=place, at=at[-1])

    def _truth(self, value: Any, at: At) -> bool:
        worked = self.value(value, at)
        if not isinstance(worked, bool):
            self._refuse(at, _kind(worked), "Fn::Equals, Fn::And, Fn::Or, Fn::Not or Condition")
        return bool(worked)

    def _parts(self, inside: Any, count: int, at: At) -> list[Any]:
        if not isinstance(inside, list) or len(inside) != count:
            self._refuse(at, _kind(inside), Message("a list of {count}", count=count))
        return list(inside)

    def _name(self, inside: Any, at: At) -> str:
        if not isinstance(inside, str):
            self._refuse(at, _kind(inside), "a name")
        return str(inside)

    def _refuse(self, at: At, found: str | Message, expected: str | Message, hint: str | Message = "") -> NoReturn:
        self._template.source.refuse(at, found, expected, hint)


_NOT_HERE = (
    "Split", "Select", "GetAZs", "Base64", "Length", "ToJsonString", "ImportValue", "Transform", "Cidr",
)  # fmt: skip
_FUNCTIONS = {
    "Ref": Functions._ref, "Fn::GetAtt": Functions._get_att, "Fn::Sub": Functions._sub, "Fn::Join": Functions._join,
    "Fn::FindInMap": Functions._find_in_map, "Fn::If": Functions._if, "Fn::Not": Functions._not,
    "Fn::And": Functions._any_or_all, "Fn::Or": Functions._any_or_all, "Fn::Equals": Functions._equals,
    "Condition": Functions._condition, **{f"Fn::{name}": Functions._not_here for name in _NOT_HERE},
}  # fmt: skip


def _kind(value: Any) -> str:
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return {dict: "a group of keys", type(None): "nothing", bool: "a condition"}.get(type(value), repr(value))
