"""Slips of unit, read from the text: degrees against radians, per cent against shares. Begin with `unit_slips`.

Every expression is given a unit where one can be told: parameters have theirs, `math` and NumPy return radians, names
have the unit of what they were last set to, in the order of the text. Where units meet that do not fit, and where a
number is compared with a parameter that never comes near it, a finding is made. What cannot be told is passed over.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator

from racecraft.worlds.deepracer.driving.reward.findings import FAULT, Finding
from racecraft.worlds.deepracer.files.reward_syntax import key_of, name_of, number_of, text_of

DEGREES, RADIANS, PERCENT = "degrees", "radians", "per cent"
PARAMETER_UNITS = {"heading": DEGREES, "steering_angle": DEGREES, "progress": PERCENT}
RANGES: dict[str, tuple[float, float]] = {
    "heading": (-180.0, 180.0),
    "steering_angle": (-30.0, 30.0),
    "progress": (-100.0, 100.0),
    "speed": (0.0, 5.0),
    "distance_from_center": (0.0, 8.0),
    "track_width": (0.0, 8.0),
}
"""The values that a parameter can have; speeds and widths with room above."""
RETURN_RADIANS = frozenset(
    {"atan", "atan2", "asin", "acos", "arctan", "arctan2", "arcsin", "arccos", "radians", "deg2rad"}
)
RETURN_DEGREES = frozenset({"degrees", "rad2deg"})
TAKE_RADIANS = frozenset({"sin", "cos", "tan", "degrees", "rad2deg"})
TAKE_DEGREES = frozenset({"radians", "deg2rad"})
KEEP_UNIT = frozenset({"abs", "fabs", "min", "max", "float", "round", "int", "absolute"})
DEGREES_A_RADIAN = 180.0 / math.pi
SMALL_ANGLE = 0.6
"""30 degrees are 0.52 rad: degrees that are compared with less than this were most likely meant in radians."""


def unit_slips(tree: ast.Module) -> list[Finding]:
    """Return the slips of unit in a parsed reward file, in the order of lines."""
    found: list[Finding] = []
    for scope in [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]:
        reader = _Reader()
        for statement in scope.body:
            reader.read(statement)
        found += reader.found
    return sorted(set(found), key=lambda finding: (finding.line or 0, finding.text))


class _Reader:
    """Reads the statements of one function in order."""

    def __init__(self) -> None:
        self.found: list[Finding] = []
        self._units: dict[str, str] = {}
        self._parameters: dict[str, str] = {}

    def read(self, node: ast.AST) -> None:
        """Look at a statement, and at what stands inside it, outermost first."""
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            return
        for part in _own_expressions(node):
            for inner in ast.walk(part):
                self._look(inner)
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
            self._assign(node)
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.stmt):
                self.read(child)

    def _assign(self, node: ast.Assign | ast.AnnAssign | ast.AugAssign) -> None:
        targets: list[ast.expr] = node.targets if isinstance(node, ast.Assign) else [node.target]
        if node.value is None:
            return
        for target in targets:
            pairs: list[tuple[ast.expr, ast.expr]] = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=False))
            for name, value in pairs:
                if not isinstance(name, ast.Name):
                    continue
                unit = self._unit(value)
                parameter = self._parameter(value)
                if isinstance(node, ast.AugAssign):
                    unit, parameter = self._units.get(name.id) or unit, None
                _set(self._units, name.id, unit)
                _set(self._parameters, name.id, parameter)

    def _look(self, node: ast.AST) -> None:
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            self._meet(node, node.left, node.right)
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            for left, right in zip(sides, sides[1:], strict=False):
                self._meet(node, left, right)
                self._compare(node, left, right)
                self._compare(node, right, left)
        elif isinstance(node, ast.Call):
            self._call(node)

    def _meet(self, node: ast.expr, left: ast.expr, right: ast.expr) -> None:
        units = {self._unit(left), self._unit(right)}
        if units == {DEGREES, RADIANS}:
            self._add(
                node, f"`{text_of(node)}` mixes degrees and radians",
                "`heading` and `steering_angle` are degrees, angles of `math` radians: convert with `math.degrees`.",
            )  # fmt: skip

    def _call(self, node: ast.Call) -> None:
        name = name_of(node)
        if not node.args:
            return
        unit = self._unit(node.args[0])
        if name in TAKE_RADIANS and unit == DEGREES:
            hint = "It is degrees already." if name in RETURN_DEGREES else "Write `math.radians(…)` around it."
            self._add(node, f"`{text_of(node)}` takes radians and is given degrees", hint)
        elif name in TAKE_DEGREES and unit == RADIANS:
            self._add(node, f"`{text_of(node)}` takes degrees and is given radians", "It is radians already.")

    def _compare(self, node: ast.Compare, side: ast.expr, other: ast.expr) -> None:
        """Judge a parameter that is compared with a number."""
        bound, parameter = number_of(other), self._parameter(side)
        if bound is None or parameter is None:
            return
        low, high = RANGES[parameter]
        low = 0.0 if _is_size(side) else low
        beyond = not low <= bound <= high or (bound == high and _asks_for_more(node, side))
        if PARAMETER_UNITS.get(parameter) == DEGREES and 0.0 < abs(bound) < SMALL_ANGLE:
            self._add(
                node, f"`{text_of(node)}` compares degrees with {bound:g}, which is "
                f"{abs(bound) * DEGREES_A_RADIAN:.0f} degrees in radians; as written it tells only whether "
                f"`{parameter}` is 0",
                f"`{parameter}` is in degrees, from {low:g} to {high:g}.",
            )  # fmt: skip
        elif parameter == "progress" and 0.0 < abs(bound) <= 1.0 and not isinstance(node.ops[0], ast.Gt | ast.GtE):
            self._add(node, f"`{text_of(node)}` compares per cent with a share", "`progress` runs from 0 to 100.")
        elif parameter == "progress" and 0.5 <= abs(bound) <= 1.0:
            self._add(node, f"`{text_of(node)}` holds from {bound:g} % of the lap on", "`progress` runs from 0 to 100.")
        elif beyond:
            self._add(
                node, f"`{text_of(node)}` is always the same: `{parameter}` lies between {low:g} and {high:g}",
                "Look at the unit: metres, metres a second, degrees.",
            )  # fmt: skip

    def _unit(self, node: ast.expr) -> str | None:
        """Return the unit of an expression; None where it cannot be told."""
        parameter = key_of(node)
        if parameter is not None:
            return PARAMETER_UNITS.get(parameter)
        if isinstance(node, ast.Name):
            return self._units.get(node.id)
        if isinstance(node, ast.UnaryOp):
            return self._unit(node.operand)
        if isinstance(node, ast.Call):
            name = name_of(node)
            if name in RETURN_RADIANS:
                return RADIANS
            if name in RETURN_DEGREES:
                return DEGREES
            return self._unit(node.args[0]) if name in KEEP_UNIT and node.args else None
        if isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Add | ast.Sub):
                units = {self._unit(node.left), self._unit(node.right)} - {None}
                return units.pop() if len(units) == 1 else None
            return self._converted(node)
        return None

    def _converted(self, node: ast.BinOp) -> str | None:
        """Return the unit of a product: `x * 180 / math.pi` turns radians into degrees."""
        if isinstance(node.op, ast.Mod):
            return self._unit(node.left)
        if not isinstance(node.op, ast.Mult | ast.Div):
            return None
        factors, angle = 1.0, None
        for part, power in _factors(node):
            unit, number = self._unit(part), number_of(part)
            if number is not None and (number or power > 0):
                factors *= number**power
            elif unit in (DEGREES, RADIANS) and angle is None and power == 1:
                angle = unit
            else:
                return None
        if angle == RADIANS and math.isclose(abs(factors), DEGREES_A_RADIAN, rel_tol=0.01):
            return DEGREES
        if angle == DEGREES and math.isclose(abs(factors), 1.0 / DEGREES_A_RADIAN, rel_tol=0.01):
            return RADIANS
        return angle if abs(factors) == 1.0 else None

    def _parameter(self, node: ast.expr) -> str | None:
        """Return the parameter that an expression is, without a change of scale."""
        if isinstance(node, ast.Name):
            return self._parameters.get(node.id)
        if isinstance(node, ast.Call) and name_of(node) in KEEP_UNIT and len(node.args) == 1:
            return self._parameter(node.args[0])
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return self._parameter(node.operand)
        key = key_of(node)
        return key if key in RANGES else None

    def _add(self, node: ast.expr, text: str, hint: str) -> None:
        self.found.append(Finding(FAULT, "unit", text, hint, node.lineno))


def _is_size(node: ast.expr) -> bool:
    """Tell whether an expression is `abs(…)`."""
    return isinstance(node, ast.Call) and name_of(node) in ("abs", "fabs", "absolute")


def _asks_for_more(node: ast.Compare, side: ast.expr) -> bool:
    """Tell whether a comparison holds only above its bound."""
    strictly = ast.Gt if node.left is side else ast.Lt
    return len(node.ops) == 1 and isinstance(node.ops[0], strictly)


def _own_expressions(node: ast.AST) -> Iterator[ast.expr]:
    """Yield the expressions of a statement that are not those of a statement inside it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            yield child


def _factors(node: ast.expr, power: int = 1) -> Iterator[tuple[ast.expr, int]]:
    """Yield the factors of a product, each with 1 or -1 for its power."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        yield from _factors(node.left, power)
        yield from _factors(node.right, -power if isinstance(node.op, ast.Div) else power)
    else:
        yield node, power


def _set(names: dict[str, str], name: str, value: str | None) -> None:
    names.pop(name, None)
    if value is not None:
        names[name] = value
