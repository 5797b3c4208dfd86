"""Where a reward came from: from what the function returned back to the lines that made it. Begin with `Flow`.

A line that adds terms is followed into each term that is a variable of its function, a field of `self`, or what a
function of the same file returned, with the number that it is multiplied by. What else a line makes is its own. The
parts add up to the reward.
"""

from __future__ import annotations

import ast
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from types import CodeType

from racecraft.worlds.deepracer.files.reward_syntax import constants_of, name_of, number_of

MAX_FOLLOWED = 200
"""So many lines are followed; what the next ones make is their own."""
CHOOSE = ("max", "min", "float", "round", "abs")
"""Functions that may return what they are given."""
FIELDS = "self.*"
"""All fields of the racer's object."""
Found = tuple[float, Callable[[float], None]]
"""The value of a term, and what gives it, so many times, to the lines that made it."""


Step = tuple[int, str, float | None, float, int]
"""A line, a variable, what it held before the line ran (None: no number) and after, and the call.
A field of the racer's object is the variable "self.name"."""


@dataclass(slots=True)
class Call:
    """A call of a function of the racer's file."""

    parent: int
    """The call that it was made from; -1: from outside the file."""
    line: int
    """The line of the parent that made it."""
    name: str
    """Of the function."""
    last_line: int
    """Where it is, and at last where it returned."""
    value: float | None = None
    """What it returned; None: no number."""
    steps: int = 0
    """How many steps there were by then."""


class Flow:
    """The statements of a file, ready to follow rewards through them."""

    def __init__(self, tree: ast.Module) -> None:
        self.constants = constants_of(tree)
        self.statements: dict[int, ast.stmt] = {}
        self._changed_by: dict[int, set[str]] = defaultdict(set)
        self._changed_in: dict[tuple[str, int], dict[int, tuple[str, ...]]] = {}
        nodes = list(ast.walk(tree))
        others = {FIELDS, *(name for node in nodes if isinstance(node, ast.Nonlocal) for name in node.names)}
        for node in nodes:
            if changed := others if isinstance(node, ast.Call) else _changed(node):
                for number in range(node.lineno, (node.end_lineno or node.lineno) + 1):  # type: ignore[attr-defined]
                    self._changed_by[number] |= changed
            if isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign | ast.Return):
                self.statements |= dict.fromkeys(range(node.lineno, (node.end_lineno or node.lineno) + 1), node)

    def changed_in(self, code: CodeType) -> dict[int, tuple[str, ...]]:
        """Return which variables of a function each line can change; FIELDS stands for all fields, line 0 for all."""
        key = code.co_name, code.co_firstlineno
        if key not in self._changed_in:
            names = dict.fromkeys((*code.co_varnames, *code.co_cellvars, *code.co_freevars))
            own = (*names, FIELDS) if "self" in names else tuple(names)
            lines = self._changed_by | {0: set().union(*self._changed_by.values())}
            found = {line: tuple(one for one in own if one in changed) for line, changed in lines.items()}
            self._changed_in[key] = {line: changed for line, changed in found.items() if changed}
        return self._changed_in[key]

    def follow(self, steps: Sequence[Step], calls: Sequence[Call]) -> Parts:
        """Return what each line paid of a reward, from its trace; see `RewardTrace`."""
        parts = Parts(self, steps, calls)
        if calls:
            parts.give_returned(0, 1.0)
        return parts


@cache
def flow_of(text: str) -> Flow:
    """Return the flow of a file."""
    return Flow(ast.parse(text.removeprefix("\ufeff")))


class Parts:
    """One reward, given to lines."""

    def __init__(self, flow: Flow, steps: Sequence[Step], calls: Sequence[Call]) -> None:
        self.by_line: dict[int, float] = defaultdict(float)
        """What each line paid."""
        self.built_up: set[str] = set()
        """Variables that several lines built up."""
        self._flow, self._steps, self._calls, self._left = flow, steps, calls, MAX_FOLLOWED
        self._changes: dict[tuple[int, str], list[int]] = defaultdict(list)
        for number, (_, name, _, _, call) in enumerate(steps):
            self._changes[_key(call, name)].append(number)
        self._used: set[int] = set()

    def give_returned(self, number: int, times: float) -> None:
        """Give what a call returned, so many times, to the lines that made it."""
        call = self._calls[number]
        made = getattr(self._flow.statements.get(call.last_line), "value", None)
        terms = [] if made is None else list(_terms(made, self._flow.constants))
        self._give(number, call.last_line, call.value or 0.0, times, call.steps, terms, made)

    def _give(
        self, call: int, line: int, amount: float, times: float, until: int,
        terms: list[tuple[ast.expr, float]], made: ast.expr | None,
    ) -> None:  # fmt: skip
        """Give an amount that a line made to what its terms came from, and the rest to the line.

        Args:
            call: In which it was made.
            line: The line.
            amount: What it made.
            times: How often it is paid.
            until: The step at which it was made; later ones are not looked at.
            terms: What it added, each with the number it is multiplied by.
            made: The whole expression.
        """
        self._left -= 1
        found: list[tuple[float, Found]] = []
        if self._left > 0:
            places = [(weight, self._find(call, node, until)) for node, weight in reversed(terms)]
            found = [(weight, one) for weight, one in places if one is not None]
            if not found and made is not None:
                choices = (
                    node for node in _choices(made) if _variable(node) not in self._flow.constants or node is made
                )
                chosen = (self._find(call, node, until) for node in choices)
                found = [(1.0, one) for one in chosen if one is not None and math.isclose(one[0], amount)][:1]
        rest = amount - sum(weight * value for weight, (value, _) in found)
        for weight, (_, give) in found:
            give(times * weight)
        if abs(rest) > 1e-12 * max(1.0, abs(amount)):
            self.by_line[line] += rest * times

    def _find(self, call: int, node: ast.expr, until: int) -> Found | None:
        """Return the value of a term; None where the file does not tell where it came from."""
        if isinstance(node, ast.Call):
            name = name_of(node)
            lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
            for number in range(len(self._calls) - 1, -1, -1):
                one = self._calls[number]
                fits = one.parent == call and one.name == name and one.line in lines and one.steps <= until
                if fits and one.value is not None and number not in self._used:
                    self._used.add(number)
                    return one.value, partial(self.give_returned, number)
            return None
        name = _variable(node)
        changes = [number for number in self._changes.get(_key(call, name), ()) if number < until]
        if not changes:
            return None
        first = next((k for k in range(len(changes) - 1, -1, -1) if self._defines(changes[k], name)), None)
        changes = changes[first or 0 :]
        began = 0.0 if first is not None else self._steps[changes[0]][2] or 0.0
        return self._steps[changes[-1]][3] - began, partial(self._give_variable, name, changes, began)

    def _give_variable(self, name: str, changes: list[int], began: float, times: float) -> None:
        """Give what a variable holds to the lines that changed it."""
        now = began
        for number in changes:
            line, _, _, value, call = self._steps[number]
            if value != now:  # a field is seen to change in a function and again in its caller
                terms, made = _added(self._flow, line, name)
                self._give(call, line, value - now, times, number, terms, made)
            now = value
        if len(changes) > 1:
            self.built_up.add(name)

    def _defines(self, number: int, name: str) -> bool:
        """Tell whether a step set a variable to something without what it held before."""
        statement = self._flow.statements.get(self._steps[number][0])
        return isinstance(statement, ast.Assign | ast.AnnAssign) and _sets(statement, name) and not _reads(
            statement.value, name
        )  # fmt: skip


def _changed(node: ast.AST) -> set[str]:
    """Return the variable that a node gives a value or takes away, or FIELDS; calls change others', too."""
    if isinstance(node, ast.Name | ast.Attribute) and not isinstance(node.ctx, ast.Load):
        return {node.id if isinstance(node, ast.Name) else FIELDS}
    if isinstance(node, ast.alias):
        return {node.asname or node.name}
    name = node.name if isinstance(node, ast.MatchAs | ast.MatchStar) else None
    return set() if name is None else {name}


def _added(flow: Flow, line: int, name: str) -> tuple[list[tuple[ast.expr, float]], ast.expr | None]:
    """Return what a line added to a variable, term by term, and the whole; nothing where it did not add."""
    statement = flow.statements.get(line)
    if statement is None or not _sets(statement, name):
        return [], None
    made: ast.expr = statement.value  # type: ignore[attr-defined]
    terms = list(_terms(made, flow.constants))
    if isinstance(statement, ast.AugAssign):
        sign = {ast.Add: 1.0, ast.Sub: -1.0}.get(type(statement.op))
        return ([], None) if sign is None else ([(node, sign * weight) for node, weight in terms], made)
    if not _reads(made, name):
        return terms, made
    others = [(node, weight) for node, weight in terms if _variable(node) != name]
    held = [weight for node, weight in terms if _variable(node) == name]
    return (others, None) if held == [1.0] else ([], None)


def _terms(node: ast.expr, constants: dict[str, float], times: float = 1.0) -> Iterator[tuple[ast.expr, float]]:
    """Yield the variables and calls that an expression adds, each with what it is multiplied by."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        yield from _terms(node.left, constants, times)
        yield from _terms(node.right, constants, times if isinstance(node.op, ast.Add) else -times)
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        left, right = number_of(node.left, constants), number_of(node.right, constants)
        if isinstance(node.op, ast.Mult) and left is not None:
            yield from _terms(node.right, constants, times * left)
        elif right:
            yield from _terms(node.left, constants, times * right if isinstance(node.op, ast.Mult) else times / right)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield from _terms(node.operand, constants, -times)
    elif isinstance(node, ast.Call) and name_of(node) == "float" and node.args:
        yield from _terms(node.args[0], constants, times)
    elif isinstance(node, ast.Call) or _variable(node):
        yield node, times


def _choices(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the variables and calls whose value an expression may be, as `max(0.1, reward)`."""
    if isinstance(node, ast.IfExp):
        inner = [node.body, node.orelse]
    elif isinstance(node, ast.Call) and name_of(node) in CHOOSE:
        inner = node.args
    else:
        yield node
        return
    for one in inner:
        yield from _choices(one)


def _variable(node: ast.AST) -> str:
    """Return "name" or "self.name", as traces have them; empty of anything else."""
    if isinstance(node, ast.Attribute):
        return f"self.{node.attr}" if isinstance(node.value, ast.Name) and node.value.id == "self" else ""
    return node.id if isinstance(node, ast.Name) else ""


def _key(call: int, name: str) -> tuple[int, str]:
    """Return what tells variables apart: those of functions by their call, fields of `self` by their name alone."""
    return (-1 if name.startswith("self.") else call), name


def _sets(statement: ast.stmt, name: str) -> bool:
    """Tell whether a statement gives a value to a variable, and to no other."""
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", statement)]
    return [_variable(target) for target in targets] == [name]


def _reads(node: ast.AST | None, name: str) -> bool:
    return node is not None and any(_variable(inner) == name for inner in ast.walk(node))
