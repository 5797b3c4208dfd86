"""A user's own network or algorithm travels with the run: its file is laid into it. Begin with `own_code_in`.

What is named as "module:Class" is found in the present folder when the training begins, and in the run's `code/`
afterwards, wherever somebody stands (`players/custom_code_loader.py`).
"""

from __future__ import annotations

import ast
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.loading import modules_beside
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.run_folder import CODE, RunFolder

TRAVELS = "__racecraft_travels__"
"""A module that was made and not read says here which texts it is remade from, by file; or why it cannot be, a str."""
NETWORKS = ("policy", "encoder")
"""Settings of `network` that name a class."""


@dataclass(frozen=True)
class OwnCode:
    """What of a policy is the user's own."""

    texts: Mapping[str, str]
    """By name of the file in the run's `code/`."""
    stays: tuple[str, ...] = ()
    """Clauses about what cannot travel, and what would let it."""


def own_code_in(spec: PolicySpec) -> OwnCode:
    """Return the files behind every class that a policy's spec names; of what is installed there are none."""
    return own_code_of_names(code_names(spec))


def own_code_of_names(names: Iterable[str]) -> OwnCode:
    """Return the files behind classes that are named "module:Class"; of any other name there are none."""
    texts: dict[str, str] = {}
    stays = []
    for named in dict.fromkeys(name for name in names if ":" in name):
        module = sys.modules.get(named.partition(":")[0])
        stored = {} if module is None else getattr(module, TRAVELS, None) or _texts_of(module)
        if isinstance(stored, str):
            stays.append(stored)
        else:
            texts.update(stored)
    return OwnCode(texts, tuple(stays))


def copy_code(texts: Mapping[str, str], run: RunFolder) -> None:
    """Lay files into a new run folder's `code/`.

    Raises:
        OutputFileError: There is no room for them.
    """
    for name, text in texts.items():
        make_folder((run.path / CODE / name).parent)
        write_atomic(run.path / CODE / name, text)


def code_names(spec: PolicySpec) -> Iterator[str]:
    """Yield every "module:Class" of a spec and its members."""
    for named in (spec.algorithm, *(spec.network.get(name) for name in NETWORKS)):
        if isinstance(named, str) and ":" in named:
            yield named
    for member in spec.policies.values():
        yield from code_names(member)


def _texts_of(module: ModuleType) -> dict[str, str]:
    """Return a module's file and what lies beside it that it imports; nothing of an installed package."""
    file = getattr(module, "__file__", None)
    if file is None or _is_installed(Path(file)) or module.__name__.partition(".")[0] == __name__.partition(".")[0]:
        return {}
    root = Path(file).resolve().parents[module.__name__.count(".") + (Path(file).name == "__init__.py")]
    return modules_beside(root / "_", ast.parse(f"import {module.__name__}"))


def _is_installed(file: Path) -> bool:
    places = {sysconfig.get_path(name) for name in ("stdlib", "platlib", "purelib")}
    return any(file.resolve().is_relative_to(Path(place).resolve()) for place in places)
