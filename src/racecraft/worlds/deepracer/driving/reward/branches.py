"""Branches that can never run, read from the text: an `elif` that asks for more than the `if` above it asked for.

Begin with `dead_branches`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from racecraft.worlds.deepracer.driving.reward.findings import FAULT, Finding
from racecraft.worlds.deepracer.files.reward_syntax import constants_of, number_of

Condition = tuple[str, type[ast.cmpop], float]
"""What is compared, how, and with which number."""
UP, DOWN = (ast.Gt, ast.GtE), (ast.Lt, ast.LtE)
MIRRORED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Eq: ast.Eq,
}


def dead_branches(tree: ast.Module) -> list[Finding]:
    """Return the branches of a parsed file that never run, because one above takes every case of theirs."""
    constants = constants_of(tree)
    inside = {id(node.orelse[0]) for node in ast.walk(tree) if isinstance(node, ast.If) and _is_elif(node)}
    found: list[Finding] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and id(node) not in inside:
            found += list(_dead(node, constants))
    return found


def _dead(first: ast.If, constants: dict[str, float]) -> Iterator[Finding]:
    above: list[tuple[ast.If, list[Condition]]] = []
    branch: ast.If | None = first
    while branch is not None:
        conditions = _conditions(branch.test, constants)
        for other, weaker in above:
            if conditions and weaker and all(any(_implies(one, part) for one in conditions) for part in weaker):
                text = ast.unparse(branch.test)
                yield Finding(
                    FAULT, "never runs", f"the branch `{text}` never runs: `{ast.unparse(other.test)}` in line "
                    f"{other.lineno} takes every case of it", "Ask for the narrower case first.", branch.lineno,
                )  # fmt: skip
                break
        above.append((branch, conditions or []))
        following = branch.orelse[0] if _is_elif(branch) else None
        branch = following if isinstance(following, ast.If) else None


def _is_elif(node: ast.If) -> bool:
    return len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If)


def _conditions(test: ast.expr, constants: dict[str, float]) -> list[Condition] | None:
    """Return the comparisons with numbers that a test joins by `and`; None where it is anything else."""
    parts = test.values if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And) else [test]
    found: list[Condition] = []
    for part in parts:
        if not (isinstance(part, ast.Compare) and len(part.ops) == 1):
            return None
        left, right, how = part.left, part.comparators[0], type(part.ops[0])
        if number_of(left, constants) is not None:
            left, right, how = right, left, MIRRORED.get(how, how)
        bound = number_of(right, constants)
        if bound is None:
            return None
        found.append((ast.unparse(left), how, bound))
    return found


def _implies(one: Condition, other: Condition) -> bool:
    """Tell whether a value that meets the first condition always meets the second."""
    if one[0] != other[0]:
        return False
    how, than = one[1], other[1]
    if than in UP and (how in UP or how is ast.Eq):
        return one[2] > other[2] or (one[2] == other[2] and (than is ast.GtE or how is ast.Gt))
    if than in DOWN and (how in DOWN or how is ast.Eq):
        return one[2] < other[2] or (one[2] == other[2] and (than is ast.LtE or how is ast.Lt))
    return how is than and one[2] == other[2]
