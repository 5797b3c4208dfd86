"""What a reward function's text tells before it is run: whether it keeps state or waits in vain.

Begin with `analyse`. Everything is read from the syntax tree; nothing is executed.

Whether a module can keep something from one call to the next is decided on the safe side: what is not plainly
stateless counts as keeping state, and costs a copy for each car.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from racecraft.contract.loading import imported_names
from racecraft.worlds.deepracer.files.reward_syntax import key_of, text_of

STATELESS_MODULES = sys.stdlib_module_names | {"numpy", "scipy", "shapely"}
"""Modules that keep nothing of a car: there is one of each in a process, however many copies of a reward there are."""
REACHES_ANYTHING = frozenset({"delattr", "eval", "exec", "globals", "locals", "setattr", "vars", "__import__"})
FIRST_STEPS = 2.0
"""What `steps` is at the first call of an episode, here as at AWS."""
NO_OBJECTS = "a time trial has no objects"
"""Said of a reward that reads of objects; in other races it does not hold."""
OBJECT_KEYS = ("closest_objects", "object_in_camera")


@dataclass(frozen=True)
class Remark:
    """Something found in the text."""

    line: int
    text: str
    """What is found, as a clause."""


@dataclass(frozen=True)
class RewardAnalysis:
    """What the text tells."""

    state: Remark | None
    """Where something may be kept from one call to the next; None: nothing can be."""
    remarks: tuple[Remark, ...]
    """What is worth telling its author."""
    imports: tuple[str, ...]
    """First names of the modules it imports, anywhere."""


def analyse(tree: ast.Module) -> RewardAnalysis:
    """Return what a parsed reward file tells."""
    state = min(_state(tree), key=lambda remark: remark.line, default=None)
    return RewardAnalysis(state, (*_vain_steps(tree), *_objects(tree)), tuple(sorted(imported_names(tree))))


def _state(tree: ast.Module) -> Iterator[Remark]:
    """Yield every place where something may be kept."""
    for statement in tree.body:
        if not _keeps_nothing(statement):
            yield Remark(statement.lineno, f"`{text_of(statement)}`")
    for node in ast.walk(tree):
        if isinstance(node, ast.Global | ast.Nonlocal):
            yield Remark(node.lineno, f"`{text_of(node)}`")
        elif isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
            yield Remark(node.lineno, f"`{text_of(node)}` is set")
        elif isinstance(node, ast.Name) and node.id in REACHES_ANYTHING:
            yield Remark(node.lineno, f"`{node.id}`")
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            defaults = [*node.args.defaults, *(value for value in node.args.kw_defaults if value is not None)]
            yield from (
                Remark(value.lineno, f"the default `{text_of(value)}`") for value in defaults if _mutable(value)
            )
            yield from (Remark(part.lineno, f"`@{text_of(part)}`") for part in getattr(node, "decorator_list", ()))
    for name in sorted(imported_names(tree) - STATELESS_MODULES):
        yield Remark(_line_of_import(tree, name), f"the module `{name}`")


_NOT_IMPORTED = ("__name__ == '__main__'", "'__main__' == __name__")


def _keeps_nothing(statement: ast.stmt) -> bool:
    """Tell whether a statement of the module leaves nothing behind that can change."""
    if isinstance(statement, ast.Import | ast.ImportFrom | ast.FunctionDef | ast.Pass):
        return True  # modules and functions are looked at by themselves
    if isinstance(statement, ast.ClassDef):
        return not (statement.decorator_list or statement.keywords) and all(map(_keeps_nothing, statement.body))
    if isinstance(statement, ast.If) and text_of(statement.test) in _NOT_IMPORTED:
        return not statement.orelse
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Constant)
    if isinstance(statement, ast.Assign):
        return all(isinstance(target, ast.Name) for target in statement.targets) and not _mutable(statement.value)
    if isinstance(statement, ast.AnnAssign):
        return isinstance(statement.target, ast.Name) and (statement.value is None or not _mutable(statement.value))
    return False


def _mutable(value: ast.expr) -> bool:
    """Tell whether a value is anything but numbers, texts, names of such, and what is computed from them."""
    plain = (
        ast.Constant, ast.Name, ast.UnaryOp, ast.BinOp, ast.BoolOp, ast.Compare, ast.Tuple, ast.IfExp, ast.Attribute,
        ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop,
    )  # fmt: skip
    return not all(isinstance(part, plain) for part in ast.walk(value))


def _vain_steps(tree: ast.Module) -> Iterator[Remark]:
    """Yield comparisons of `steps` that hold at no call, because the first call already sees 2."""
    names = {"steps"} | {text_of(target) for node in ast.walk(tree) for target in _takes_steps(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            left, right = node.left, node.comparators[0]
            vain = _is_steps(left, names) and _never(node.ops[0], right)
            vain = vain or (_is_steps(right, names) and _never(_MIRRORED.get(type(node.ops[0])), left))
            if vain:
                yield Remark(
                    node.lineno,
                    f"`{text_of(node)}` never holds: `steps` is {FIRST_STEPS} at the first call of an episode, here as "
                    f"at AWS; for the first call ask `steps <= {FIRST_STEPS:g}`",
                )


def _takes_steps(node: ast.AST) -> list[ast.expr]:
    """Return what is set to `params["steps"]` by a node."""
    if isinstance(node, ast.Assign) and _is_steps(node.value, set()):
        return node.targets
    if isinstance(node, ast.AnnAssign) and node.value is not None and _is_steps(node.value, set()):
        return [node.target]
    return []


def _is_steps(node: ast.expr, names: set[str]) -> bool:
    """Tell whether an expression is the parameter `steps`, or a name of it."""
    if isinstance(node, ast.Call) and text_of(node.func) in ("int", "float", "round") and len(node.args) == 1:
        return _is_steps(node.args[0], names)
    return key_of(node) == "steps" or (isinstance(node, ast.Name | ast.Attribute) and text_of(node) in names)


_MIRRORED: dict[type[ast.cmpop], ast.cmpop] = {ast.Eq: ast.Eq(), ast.Gt: ast.Lt(), ast.GtE: ast.LtE()}


def _never(operator: ast.cmpop | None, bound: ast.expr) -> bool:
    """Tell whether `steps OPERATOR bound` holds for none of 2, 3, 4 and so on."""
    if not isinstance(bound, ast.Constant) or not isinstance(bound.value, int | float):
        return False
    number = float(bound.value)
    if isinstance(operator, ast.Eq):
        return number < FIRST_STEPS or number != int(number)
    if isinstance(operator, ast.Lt):
        return number <= FIRST_STEPS
    return isinstance(operator, ast.LtE) and number < FIRST_STEPS


def _objects(tree: ast.Module) -> Iterator[Remark]:
    """Yield one remark about what is read of objects: there are none in a time trial."""
    read: dict[str, int] = {}
    for node in ast.walk(tree):
        key = key_of(node)
        if key is not None and (key.startswith("objects_") or key in OBJECT_KEYS):
            read.setdefault(key, getattr(node, "lineno", 1))
    if read:
        yield Remark(
            min(read.values()),
            f"{', '.join(f'`{key}`' for key in sorted(read))}: {NO_OBJECTS}, so lists of them are empty, here "
            "as at AWS",
        )


def _line_of_import(tree: ast.Module, name: str) -> int:
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom))
    return min(node.lineno for node in nodes if name in imported_names(node))
