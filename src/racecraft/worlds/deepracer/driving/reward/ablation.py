"""Which lines matter: each is taken out in turn, and the same moments are paid again. Begin with `ablate`.

A line whose removal changes nothing on any moment has no effect; a term that moves the pay by less than a hundredth of
what the pay varies is drowned. Lines are whole statements of the reward function and the functions beside it, and
single terms of a sum.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.findings import NOTE, Finding
from racecraft.worlds.deepracer.files.reward_source import RewardSource
from racecraft.worlds.deepracer.files.reward_syntax import text_of

DROWNS = 100.0
MAX_CUTS = 40
"""More lines are not tried, so that a check stays quick."""


@dataclass(frozen=True)
class Cut:
    """A part that was taken out."""

    line: int
    text: str
    is_term: bool
    """It is added to something, so its size can be compared with that of others."""
    effect: float
    """Mean size of the change of the pay, over the moments in which it changes; 0: in none; infinity: the function
    fails without it."""
    end_line: int


def ablate(
    source: RewardSource, lines: frozenset[int], pay: Callable[[RewardSource], Array], as_it_is: Array
) -> list[Cut]:
    """Return what each part does to the pay.

    Args:
        source: The racer's file.
        lines: The lines that ran; others are not tried.
        pay: Pays the moments with a changed source: float64 (T,), NaN where one fails.
        as_it_is: What the file as it is pays for them.
    """
    cuts = []
    for place, tree in _variants(source, lines):
        try:
            paid = pay(replace(source, text=ast.unparse(tree)))
        except (RewardFileError, RewardError):
            continue
        fails = (np.isnan(paid) & ~np.isnan(as_it_is)).any()
        change = np.abs(paid - as_it_is)
        effect = np.inf if fails else float(change[change > 0].mean()) if (change > 0).any() else 0.0
        cuts.append(Cut(place.line, place.text, place.is_term, effect, place.end[0] or place.line))
    return cuts


def ablation_findings(cuts: list[Cut], as_it_is: Array) -> list[Finding]:
    """Return the parts without effect, and the terms that the rest drowns.

    Args:
        cuts: What each part does.
        as_it_is: What the file pays for the moments, as it is.
    """
    spread = float(np.nanmean(np.abs(as_it_is - np.nanmedian(as_it_is))))
    without = [cut for cut in cuts if cut.effect == 0.0]
    silent = [
        Finding(NOTE, "no effect", f"`{cut.text}` never changes the pay", "Take it out, or look why it has no effect.",
                cut.line)
        for number, cut in enumerate(without)
        if not any(outer.line <= cut.line and cut.end_line <= outer.end_line for outer in without[:number])
    ]  # fmt: skip
    return silent + [
        Finding(NOTE, "drowned", f"`{cut.text}` moves the pay by {cut.effect:.3g}, and the pay varies by "
                f"{spread:.3g}: it is drowned", "Bring the terms to one scale.", cut.line)
        for cut in cuts if cut.is_term and 0.0 < cut.effect * DROWNS < spread
    ]  # fmt: skip


def _variants(source: RewardSource, lines: frozenset[int]) -> Iterator[tuple[_Place, ast.Module]]:
    """Yield each part and the tree without it."""
    tree = source.tree
    places = [place for place in _places(tree) if place.line in lines][:MAX_CUTS]
    for place in places:
        cut = copy.deepcopy(tree)
        place.take_out(cut)
        yield place, ast.fix_missing_locations(cut)


@dataclass(frozen=True)
class _Place:
    """A part of a tree, found again in a copy of it by its position."""

    line: int
    column: int
    end: tuple[int | None, int | None]
    kind: type[ast.AST]
    text: str
    adds: bool
    """It is `+=` or `-=`."""

    @property
    def is_term(self) -> bool:
        """Whether it is added to something."""
        return not issubclass(self.kind, ast.stmt) or self.adds

    def take_out(self, tree: ast.Module) -> None:
        """Put nothing in its place: `pass`, or 0 for a term."""
        _Remover(self).visit(tree)

    def is_at(self, node: ast.AST) -> bool:
        """Whether a node of a copy is this part."""
        return (
            type(node) is self.kind
            and (getattr(node, "lineno", None), getattr(node, "col_offset", None)) == (self.line, self.column)
            and (getattr(node, "end_lineno", None), getattr(node, "end_col_offset", None)) == self.end
        )


class _Remover(ast.NodeTransformer):
    """Replaces one part."""

    def __init__(self, place: _Place) -> None:
        self._place = place

    def visit(self, node: ast.AST) -> ast.AST:
        """Return what stands for a node."""
        if self._place.is_at(node):
            if isinstance(node, ast.stmt):
                return ast.copy_location(ast.Pass(), node)
            return ast.copy_location(ast.Constant(0.0), node)
        return super().generic_visit(node)


def _places(tree: ast.Module) -> Iterator[_Place]:
    """Yield the parts worth taking out: what changes a number again, whole branches, and terms of sums."""
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        known: set[str] = set()
        for node in _statements(function):
            if isinstance(node, ast.If | ast.AugAssign):
                yield _place(node)
            elif isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
                name = node.targets[0].id
                if name in known:
                    yield _place(node)
                known.add(name)
            if isinstance(node, ast.Return | ast.Assign) and node.value is not None:
                yield from (_place(term) for term in _terms(node.value))


def _statements(function: ast.FunctionDef) -> Iterator[ast.stmt]:
    """Yield a function's statements in the order of the text, those of functions inside it aside."""
    waiting: list[ast.stmt] = list(reversed(function.body))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        yield node
        if not isinstance(node, ast.While):  # without a line of its body it may never end
            waiting += reversed(_children(node))


def _children(node: ast.stmt) -> list[ast.stmt]:
    return [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt)]


def _terms(value: ast.expr) -> Iterator[ast.expr]:
    """Yield the terms of a sum of two and more; of `float(a + b)` those inside."""
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id == "float" and value.args:
        value = value.args[0]
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add | ast.Sub):
        for side in (value.left, value.right):
            inner = list(_terms(side))
            if inner:
                yield from inner
            elif not isinstance(side, ast.Constant):
                yield side


def _place(node: ast.stmt | ast.expr) -> _Place:
    adds = isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub)
    return _Place(
        node.lineno,
        node.col_offset,
        (node.end_lineno, node.end_col_offset),
        type(node),
        text_of(node).rstrip(":"),
        adds,
    )
