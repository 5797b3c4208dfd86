"""The path data of SVG as polylines. Begin with `parse_path`.

Source: SVG 1.1, chapter 8 (paths), appendix F.6 (arcs), chapter 7 (transforms).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

CURVE_POINTS = 24
"""Straight pieces of a curve."""
_TOKEN = re.compile(r"([MmLlHhVvCcSsQqTtAaZz])|([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def parse_path(text: str) -> list[tuple[np.ndarray, bool]]:
    """Return the subpaths of path data: points (P, 2), and whether each is closed.

    Raises:
        ValueError: A command is unknown or lacks numbers.

    >>> [(line.tolist(), closed) for line, closed in parse_path("M0 0h4v3z")]
    [([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], True)]
    """
    found: list[tuple[list[complex], bool]] = []
    here = start = 0j
    handle, before = 0j, ""
    for command, numbers in _commands(text):
        kind, relative = command.upper(), command.islower()
        base = here if relative else 0j
        points = [base + complex(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=False)]
        if kind == "Z":
            if found:
                found[-1] = (found[-1][0], True)
            here, before = start, kind
            continue
        if kind == "M":
            here = start = points[0]
            found.append(([here], False))
            before = kind
            continue
        if not found or found[-1][1]:
            found.append(([here], False))
        curve, handle_now = [here], here
        if kind == "L":
            curve = [points[0]]
        elif kind == "H":
            curve = [complex(numbers[0] + (here.real if relative else 0.0), here.imag)]
        elif kind == "V":
            curve = [complex(here.real, numbers[0] + (here.imag if relative else 0.0))]
        elif kind in "CS":
            first = points[0] if kind == "C" else 2 * here - handle if before in ("C", "S") else here
            curve, handle_now = _bezier([here, first, *points[-2:]]), points[-2]
        elif kind in "QT":
            middle = points[0] if kind == "Q" else 2 * here - handle if before in ("Q", "T") else here
            curve, handle_now = _bezier([here, middle, points[-1]]), middle
        else:
            curve = _arc(here, base + complex(numbers[5], numbers[6]), numbers)
        found[-1][0].extend(curve)
        here, handle, before = curve[-1], handle_now, kind
    return [(np.array([(point.real, point.imag) for point in line]), closed) for line, closed in found]


def parse_transform(text: str) -> np.ndarray:
    """Return a list of transforms as one matrix (3, 3).

    Raises:
        ValueError: One of them is unknown.

    >>> (parse_transform("translate(2,1) scale(3)") @ [1, 1, 1]).tolist()
    [5.0, 4.0, 1.0]
    """
    whole = np.eye(3)
    for name, inner in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        v = [float(word) for word in re.findall(r"[-+.\deE]+", inner)]
        one = np.eye(3)
        if name == "matrix" and len(v) == 6:
            one[:2] = [[v[0], v[2], v[4]], [v[1], v[3], v[5]]]
        elif name == "translate" and v:
            one[:2, 2] = v[0], v[1] if len(v) > 1 else 0.0
        elif name == "scale" and v:
            one[0, 0], one[1, 1] = v[0], v[1] if len(v) > 1 else v[0]
        elif name == "rotate" and v:
            c, s = math.cos(math.radians(v[0])), math.sin(math.radians(v[0]))
            x, y = (v[1], v[2]) if len(v) > 2 else (0.0, 0.0)
            one[:2] = [[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y]]
        elif name in ("skewX", "skewY") and v:
            one[(0, 1) if name == "skewX" else (1, 0)] = math.tan(math.radians(v[0]))
        else:
            raise ValueError(f"transform {name}({inner[:30]})")
        whole = whole @ one
    return whole


def _commands(text: str) -> Iterator[tuple[str, list[float]]]:
    """Yield each command with the numbers of one repetition; further pairs behind M are lines."""
    command, numbers = "", list[float]()
    for token in [*_TOKEN.finditer(text), None]:
        if token is not None and token[2]:
            numbers.append(float(token[2]))
            if not command or not _COUNT[command.upper()]:
                raise ValueError(f"number {token[2]} without a command")
            if len(numbers) == _COUNT[command.upper()]:
                yield command, numbers
                numbers, command = [], {"M": "L", "m": "l"}.get(command, command)
            continue
        if numbers:
            raise ValueError(f"{command} with {len(numbers)} numbers; expected {_COUNT[command.upper()]}")
        if token is not None:
            command = token[1]
            if command in "Zz":
                yield command, []


def _bezier(handles: list[complex]) -> list[complex]:
    """Return points of a Bézier curve behind its first."""
    found = []
    for share in np.linspace(0.0, 1.0, CURVE_POINTS + 1)[1:].tolist():
        rest = handles
        while len(rest) > 1:
            rest = [a + share * (b - a) for a, b in zip(rest, rest[1:], strict=False)]
        found.append(rest[0])
    return found


def _arc(here: complex, there: complex, numbers: list[float]) -> list[complex]:
    """Return points of an elliptical arc behind its first; radii that do not reach are enlarged."""
    rx, ry, turn, large, sweep = abs(numbers[0]), abs(numbers[1]), math.radians(numbers[2]), numbers[3], numbers[4]
    if rx == 0 or ry == 0 or here == there:
        return [there]
    rotation = complex(math.cos(turn), math.sin(turn))
    half = (here - there) / 2 / rotation
    unit = complex(half.real / rx, half.imag / ry)
    grown = max(1.0, abs(unit))
    rx, ry, unit = rx * grown, ry * grown, unit / grown
    off = math.sqrt(max(0.0, 1.0 / abs(unit) ** 2 - 1.0)) * (1 if bool(large) == bool(sweep) else -1)
    centre = 1j * unit * off
    first, last = unit - centre, -unit - centre
    begin = math.atan2(first.imag, first.real)
    span = math.atan2(last.imag, last.real) - begin
    if sweep and span < 0:
        span += 2 * math.pi
    elif not sweep and span > 0:
        span -= 2 * math.pi
    middle = (here + there) / 2
    angles = begin + span * np.linspace(0.0, 1.0, CURVE_POINTS + 1)[1:]
    found = []
    for angle in angles.tolist():
        point = centre + complex(math.cos(angle), math.sin(angle))
        found.append(middle + rotation * complex(point.real * rx, point.imag * ry))
    return [*found[:-1], there]
