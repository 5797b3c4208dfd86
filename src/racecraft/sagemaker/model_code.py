"""A file whose functions serve a model: which of SageMaker's are called here. Begin with `model_code`."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.sagemaker.container import check_code, container_in, make_job_folders

FUNCTIONS = ("model_fn", "input_fn", "predict_fn", "output_fn")
"""By these a file serves a model (`serving/model_functions.py`)."""
NOT_CALLED = ("transform_fn", "input_handler", "output_handler")
"""Others of SageMaker's containers, which no endpoint here calls."""


@dataclass(frozen=True)
class ModelCode:
    """A file with some of `FUNCTIONS`, and what lies beside it."""

    entry_point: str
    source_dir: str | None
    dependencies: tuple[str, ...]
    environment: tuple[str, ...] = ()
    """NAME=VALUE of the variables that `env` sets."""

    def copy_into(self, folder: Path) -> Path:
        """Copy it into an endpoint's folder, so that it answers when the notebook has gone on; return the file."""
        make_job_folders(folder, self.entry_point, self.source_dir, self.dependencies, {}, {})
        return container_in(folder).code / (self.entry_point if self.source_dir else Path(self.entry_point).name)


def model_code(words: Mapping[str, Any]) -> ModelCode | None:
    """Return the code that an SDK's `entry_point`, `source_dir`, `dependencies` and `env` name; None: none serves.

    Raises:
        SettingError: It serves by a function that no endpoint here calls.
        CodeError: A dependency is not there.
    """
    entry_point, source_dir = words.get("entry_point"), words.get("source_dir")
    path = Path(source_dir or ".", entry_point or "")
    names = _functions_of(path) if path.is_file() else {}
    for name in NOT_CALLED:
        if name in names:
            raise SettingError(
                "{path}:{line}: {name} is to serve the model, and no endpoint here calls it; expected {expected}.",
                path=path, line=names[name], name=name, expected=", ".join(FUNCTIONS),
            )  # fmt: skip
    if not names.keys() & set(FUNCTIONS):
        return None
    dependencies = check_code(str(entry_point), source_dir, words.get("dependencies") or (), ())
    environment = tuple(f"{name}={value}" for name, value in (words.get("env") or {}).items())
    return ModelCode(str(entry_point), source_dir, tuple(dependencies), environment)


def _functions_of(path: Path) -> dict[str, int]:
    """Return the functions of a file, by name the line; none where it does not compile, which loading it tells."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return {}
    return {node.name: node.lineno for node in tree.body if isinstance(node, ast.FunctionDef)}
