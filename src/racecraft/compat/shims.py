"""Puts foreign names on the path for one script. Begin with `run_script`.

A name such as `mlagents_envs.environment` leads to our module `racecraft.compat.names.mlagents_envs.environment`: one
module with two names. `gym` stands aside where a real one is installed; the others are ours even then, because
ML-Agents' own package does not load beside today's protobuf.

Processes that the script starts with `multiprocessing` (spawn and forkserver too) or joblib begin with its search path,
and nothing else of it. So two folders stand there while names are lent: `lent/before` with those that are ours in any
case, `lent/behind` with those that stand aside. Each holds a module of a foreign name that calls `take_over`.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import runpy
import sys
from collections.abc import Iterator, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

from racecraft.compat.notebooks import SUFFIX, run_notebook
from racecraft.compat.old_numpy import old_names
from racecraft.compat.undefined_names import sentence, unset_names
from racecraft.compat.unknown_names import HOME, error_about, name_error_message
from racecraft.contract.errors import InputFileError

NAMES = (
    "mlagents_envs",
    "gym_unity",
    "gym",
    "sagemaker",
    "sagemaker_rl",
    "ray",
    "rl_coach",
    "boto3",
    "IPython",
    "tensorflow",
    "tf_slim",
)
"""The packages whose names are lent."""
STANDS_ASIDE = ("gym", "boto3", "IPython", "tensorflow", "tf_slim")
"""Lent only where no package of that name is installed; boto3 also where it is, and has no credentials to ask with."""
FOR_SCRIPTS_ONLY = ("tensorflow", "tf_slim")
"""Lent to files of the script's own folder only: other packages look whether it is there, to use it."""
CREDENTIALS = (
    "AWS_ACCESS_KEY_ID", "AWS_PROFILE", "AWS_WEB_IDENTITY_TOKEN_FILE", "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
)  # fmt: skip
"""Variables that tell a real boto3 who asks."""
_BEFORE, _BEHIND = (str(Path(__file__).parent / "lent" / place) for place in ("before", "behind"))
"""Where children find the names: the modules in these folders are the doors of `take_over`."""


def run_script(script: str | Path, args: Sequence[str] = (), goes_on: bool = False) -> None:
    """Run a script as `python SCRIPT ARGS…` would, or a notebook's cells, with the foreign names on the path.

    Args:
        script: The file.
        args: Its own words.
        goes_on: Whether a notebook's cells are run on behind one that fails.

    Raises:
        InputFileError: There is no such file.
        UnknownNameError: It asks for what nobody has.
    """
    path = Path(script)
    if not path.is_file():
        raise InputFileError(path, "there is no such file", "a Python script, such as train-unity.py, or a notebook")
    lent = [name for top in _lent() for name in _offered(top)]
    with name_error_message(lent), foreign_names(), old_names(), as_main(path, args):
        if path.suffix == SUFFIX:
            run_notebook(path, goes_on, lambda error: error_about(error, lent))
        else:
            for _, name in unset_names([path.read_bytes()]):
                print(f"- {path.name}: {sentence(name)}", flush=True)
            runpy.run_path(str(path), run_name="__main__")


@contextlib.contextmanager
def foreign_names() -> Iterator[None]:
    """Lend the names; afterwards neither they nor their modules are left."""
    lent, search = _lent(), list(sys.path)
    before = {name: module for name, module in sys.modules.items() if _top(name) in lent}
    for name in before:
        del sys.modules[name]
    finder = _Finder(lent)
    sys.meta_path.insert(0, finder)
    sys.path[:] = [_BEFORE, *search, _BEHIND]
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        sys.path[:] = search
        for name in [name for name in sys.modules if _top(name) in lent]:
            del sys.modules[name]
        sys.modules.update(before)


def take_over(name: str) -> None:
    """Lend the names for good, in a process that a script started, and put our module in the place of a foreign one.

    Args:
        name: The foreign name, as it is being imported from `lent/`.
    """
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder(_lent()))
    sys.modules[name] = importlib.import_module(f"{HOME}.{name}")


class _Finder(MetaPathFinder):
    """Finds foreign names under our roof."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if _top(fullname) not in self._names:
            return None
        if fullname in FOR_SCRIPTS_ONLY and not _is_imported_by_script():
            return None
        ours = f"{HOME}.{fullname}"
        found = importlib.util.find_spec(ours)
        if found is None:
            raise ModuleNotFoundError(
                f"No module named '{fullname}': `racecraft run` offers {', '.join(_offered(_top(fullname)))}.",
                name=fullname,
            )
        return ModuleSpec(fullname, _Lender(ours), is_package=found.submodule_search_locations is not None)


class _Lender(Loader):
    """Gives the module that stands under our roof, already executed."""

    def __init__(self, ours: str) -> None:
        self._ours = ours

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(self._ours)
        self._own_spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._own_spec  # the import system has just overwritten it


def _is_imported_by_script() -> bool:
    """Tell whether the import under way stands in a file of the script's folder, or in a notebook's cell."""
    frame = sys._getframe(1)
    while frame is not None and (
        frame.f_globals.get("__name__") == __name__ or "importlib" in frame.f_code.co_filename
    ):
        frame = frame.f_back  # type: ignore[assignment]
    if frame is None:
        return False
    here, file = Path(sys.argv[0]).resolve().parent, Path(frame.f_code.co_filename).resolve()
    return frame.f_globals.get("__name__") == "__main__" or file.is_relative_to(here)


@contextlib.contextmanager
def as_main(path: Path, args: Sequence[str]) -> Iterator[None]:
    """Let the script see its own arguments, and find its neighbours first."""
    argv, search = sys.argv, list(sys.path)
    sys.argv = [str(path), *args]
    sys.path.insert(0, str(path.resolve().parent))
    try:
        yield
    finally:
        sys.argv = argv
        sys.path[:] = search


def _lent() -> tuple[str, ...]:
    """Return the names that are lent here: of those that stand aside, the ones nobody else has."""
    ours = os.path.dirname(_BEHIND)
    found = {name: PathFinder.find_spec(name) for name in STANDS_ASIDE}
    taken = {name for name, spec in found.items() if spec is not None and not (spec.origin or "").startswith(ours)}
    if "boto3" in taken and not _has_credentials():
        taken.remove("boto3")
    return tuple(name for name in NAMES if name not in taken)


def _has_credentials() -> bool:
    """Tell whether somebody set up AWS here; a machine of AWS's own that has a role only sets AWS_PROFILE for us."""
    if any(os.environ.get(name) for name in CREDENTIALS):
        return True
    files = {"AWS_SHARED_CREDENTIALS_FILE": "credentials", "AWS_CONFIG_FILE": "config"}
    return any(Path(os.environ.get(name) or Path.home() / ".aws" / file).is_file() for name, file in files.items())


def _offered(top: str) -> list[str]:
    """Return every module of a lent package, by its foreign name."""
    root = Path(__file__).parent / "names"
    files = sorted((root / top).rglob("*.py"))
    names = [os.path.relpath(file, root).removesuffix(".py").replace(os.sep, ".") for file in files]
    return [name.removesuffix(".__init__") for name in names]


def _top(name: str) -> str:
    return name.partition(".")[0]
