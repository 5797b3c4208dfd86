"""The JSON Schema of a request or a result (draft 2020-12). Begin with `request_schema`."""

from __future__ import annotations

import dataclasses
import types
import typing
from pathlib import Path
from typing import Any

from racecraft.settings.request import Option, options_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"
NAMES = {int: "integer", float: "number", bool: "boolean", str: "string", Path: "string", dict: "object", list: "array"}


def request_schema(request: type) -> dict[str, Any]:
    """Return the schema of a request: its options and those of its groups, by name.

    >>> from racecraft.settings.request import Request, option
    >>> @dataclasses.dataclass(frozen=True, kw_only=True)
    ... class Drive(Request):
    ...     laps: int = option(3, "How many.", low=1)
    >>> request_schema(Drive)["properties"]["laps"]
    {'type': 'integer', 'description': 'How many.', 'default': 3, 'minimum': 1}
    """
    rows = options_of(request)
    return {
        "type": "object",
        "properties": {row.name.strip("_"): _option(row) for row in rows},
        "required": [row.name.strip("_") for row in rows if row.is_required],
        "additionalProperties": False,
    }


def result_schema(results: tuple[type, ...]) -> dict[str, Any]:
    """Return the schema of what `--json` prints; figures that depend on what was asked are not listed."""
    schemas = [_result(result) for result in results]
    return schemas[0] if len(schemas) == 1 else {"anyOf": schemas} if schemas else {"type": "object"}


def _option(row: Option) -> dict[str, Any]:
    schema = {**_type(row.kind), "description": row.doc}
    if not row.is_required:
        schema["default"] = list(row.default) if isinstance(row.default, tuple) else _plain(row.default)
    bounds = {"minimum": row.low, "maximum": row.high}
    inner = schema.get("items", schema)
    inner |= {name: bound for name, bound in bounds.items() if bound is not None}
    inner |= {"enum": list(row.choices)} if row.choices else {}
    return schema | ({"x-unit": row.unit} if row.unit else {})


def _result(result: type) -> dict[str, Any]:
    schema = {"type": "object", "description": (result.__doc__ or "").split("\n")[0]}
    if hasattr(result, "as_dictionary") or not dataclasses.is_dataclass(result):
        return schema
    try:
        kinds = typing.get_type_hints(result)
    except NameError:  # a class that is imported for type checks only
        kinds = {}
    names = [field.name for field in dataclasses.fields(result)]
    return {**schema, "properties": {name: _type(kinds.get(name, Any)) for name in names}, "required": names}


def _type(kind: Any) -> dict[str, Any]:
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin in (tuple, list):
        return {"type": "array", "items": _type(parts[0])}
    if origin in (typing.Union, types.UnionType):
        names = [_type(part).get("type") for part in parts if part is not types.NoneType]
        return {"type": [*names, "null"]} if all(names) else {}
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _result(kind)
    name = NAMES.get(origin or kind)
    return {} if name is None else {"type": name}


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
