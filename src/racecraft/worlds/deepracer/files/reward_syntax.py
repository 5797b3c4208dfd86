"""What expressions of a racer's file are: numbers, names, parameters, text. See `number_of` and `key_of`."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping

MAX_TEXT = 60
"""Characters of a quoted expression."""


def constants_of(tree: ast.Module) -> dict[str, float]:
    """Return the names that are set once in the whole file, and to a number."""
    stores = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    once = {node.id for node in stores if sum(other.id == node.id for other in stores) == 1}
    found: dict[str, float] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id in once:
            value = number_of(node.value)
            if value is not None:
                found[node.targets[0].id] = value
    return found


def number_of(node: ast.expr, constants: Mapping[str, float] | None = None) -> float | None:
    """Return the value of an expression of numbers, pi and constants; None of another.

    >>> number_of(ast.parse("-180 / math.pi", mode="eval").body)
    -57.29577951308232
    """
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name):
        return None if constants is None else constants.get(node.id)
    if isinstance(node, ast.Attribute) and node.attr == "pi":
        return math.pi
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = number_of(node.operand, constants)
        return None if inner is None else -inner
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        left, right = number_of(node.left, constants), number_of(node.right, constants)
        if left is None or right is None or (isinstance(node.op, ast.Div) and right == 0.0):
            return None
        return left * right if isinstance(node.op, ast.Mult) else left / right
    return None


def name_of(node: ast.AST) -> str:
    """Return the last name of `name`, `module.name` and of what `name(…)` calls; empty of anything else."""
    if isinstance(node, ast.Call):
        return name_of(node.func)
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def key_of(node: ast.AST) -> str | None:
    """Return the text that something is looked up by: `params["steps"]`, `params.get("steps", 0)`; None of another."""
    found: ast.expr | None = None
    if isinstance(node, ast.Subscript):
        found = node.slice
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "get" and node.args:
        found = node.args[0]
    return found.value if isinstance(found, ast.Constant) and isinstance(found.value, str) else None


def text_of(node: ast.AST) -> str:
    """Return the first line of a node as it is written, cut where it is long."""
    text = ast.unparse(node).split("\n")[0]
    return text if len(text) <= MAX_TEXT else f"{text[: MAX_TEXT - 3]}..."
