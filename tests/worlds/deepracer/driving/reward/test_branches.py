"""An `elif` that asks for more than the branch above it never runs, and is named; the right order is left alone."""

import ast

import pytest

from racecraft.worlds.deepracer.driving.reward.branches import dead_branches

DEAD = [
    "if v > 2.5:\n    r = 2\nelif v > 3.5:\n    r = 3",
    "if v > 2.5 and a < 20:\n    r = 2\nelif v > 3.5 and a < 15:\n    r = 3",
    "LIMIT = 15\nMORE = 45\nif d > LIMIT:\n    r = 2\nelif d > MORE:\n    r = 3",
    "if d < 0.5:\n    r = 1\nelif d > 2:\n    r = 2\nelif 0.25 >= d:\n    r = 3",
    "if v >= 2:\n    r = 1\nelif v == 2:\n    r = 2",
]
ALIVE = [
    "if v > 3.5:\n    r = 3\nelif v > 2.5:\n    r = 2",
    "if v > 2.5 or a < 20:\n    r = 2\nelif v > 3.5 and a < 15:\n    r = 3",
    "if v > 2:\n    r = 1\nelif v >= 2:\n    r = 2",
    "LIMIT = 15\nLIMIT = 50\nif d > LIMIT:\n    r = 2\nelif d > 45:\n    r = 3",
]


@pytest.mark.parametrize("text", DEAD)
def test_a_branch_that_never_runs_is_named(text):
    (found,) = dead_branches(ast.parse(text))
    assert "never runs" in found.text
    assert "elif" in text.splitlines()[found.line - 1]


@pytest.mark.parametrize("text", ALIVE)
def test_a_branch_that_can_run_is_left_alone(text):
    assert dead_branches(ast.parse(text)) == []
