"""Reward functions to begin with, a file each; the first line of its docstring says what it pays for.

`sample_names` lists them, `read_sample` returns the text of one. They are racers' files: nothing here imports them.
"""

from __future__ import annotations

import ast
from pathlib import Path

from racecraft.contract.errors import SettingError, nearest

FOLDER = Path(__file__).parent


def sample_names() -> list[str]:
    """Return the names of all samples, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__init__")


def read_sample(name: str) -> str:
    """Return the text of a sample.

    Raises:
        SettingError: There is none of this name.
    """
    if name not in sample_names():
        raise SettingError("'{found}': there is no such sample. {hint}", found=name, hint=nearest(name, sample_names()))
    return (FOLDER / f"{name}.py").read_text(encoding="utf-8")


def describe_sample(name: str) -> str:
    """Return the first line of a sample's docstring.

    Raises:
        SettingError: There is none of this name.
    """
    return (ast.get_docstring(ast.parse(read_sample(name))) or "").splitlines()[0]
