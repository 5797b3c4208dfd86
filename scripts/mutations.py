"""What can be changed in a module's text, one small thing at a time: the breakages of `mutants.py`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

COMPARED = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
COUNTED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change."""

    path: Path
    """From the root of the repository."""
    number: int
    """Which of the file's places."""
    line: int
    last_line: int
    what: str


def mutants_in(package: Path, root: Path) -> Iterator[Mutant]:
    """Yield every mutant of the modules below a package, a folder from the root of the repository, or of one file."""
    place = root / package
    for path in [place] if place.suffix else sorted(place.rglob("*.py")):
        near = path.relative_to(root)
        for number, (node, what) in enumerate(places(ast.parse(path.read_text(encoding="utf-8")))):
            yield Mutant(near, number, node.lineno, node.end_lineno or node.lineno, what)


def places(tree: ast.Module) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield what can be changed and how, in the order of the file; docstrings, types and messages are left alone."""
    for node in _code(tree):
        if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
            yield node, f"{ast.unparse(node)}: the comparison turned round"
        elif isinstance(node, ast.BinOp) and type(node.op) in COUNTED and not _is_text(node):
            yield node, f"{ast.unparse(node)}: another operator"
        elif isinstance(node, ast.BoolOp):
            yield node, f"{ast.unparse(node)}: and for or"
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            yield node, f"{ast.unparse(node)}: its sign left out"
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            yield node, f"{ast.unparse(node)}: another constant"
        elif isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
            yield node, f"{ast.unparse(node).splitlines()[0]}: left out"


def changed(source: str, number: int) -> str:
    """Return a module's text with one of its places changed."""
    tree = ast.parse(source)
    node = list(places(tree))[number][0]
    if isinstance(node, ast.Compare):
        node.ops[0] = COMPARED[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp):
        node.op = COUNTED[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.Constant):
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else node.op
        node.operand = node.operand if isinstance(node.op, ast.UAdd) else ast.UnaryOp(ast.Not(), node.operand)
    else:
        _leave_out(tree, node)
    return ast.unparse(ast.fix_missing_locations(tree))


def _code(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes that do something: no annotations, no words of errors, no text."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop(0)
        yield node
        if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr | ast.Import | ast.ImportFrom):
            continue
        skipped = {"annotation", "returns", "decorator_list", "type_params"}
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        for name, value in ast.iter_fields(node):
            if name not in skipped:
                waiting += [one for one in (value if isinstance(value, list) else [value]) if isinstance(one, ast.AST)]


def _is_text(node: ast.BinOp) -> bool:
    return any(
        isinstance(one, ast.JoinedStr) or (isinstance(one, ast.Constant) and isinstance(one.value, str))
        for one in ast.walk(node)
    )


def _leave_out(tree: ast.Module, gone: ast.AST) -> None:
    for node in ast.walk(tree):
        for _, value in ast.iter_fields(node):
            if isinstance(value, list) and any(one is gone for one in value):
                value[[one is gone for one in value].index(True)] = ast.Pass()
