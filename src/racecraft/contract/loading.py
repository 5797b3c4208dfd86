"""The loader of users' code: classes by "module:Class", and files with the modules beside them.

`load_class` imports once, as Python does. `UserModules` loads a file as often as copies of it are needed, a car's each:
a module beside the file (`racing_line.py`, a folder `helpers/`) is imported from there and belongs to one copy, like
the file itself; modules of Python and of installed packages are shared, and Python's own names are never taken. Texts
are read once, so that later copies equal the first and a run folder can hold them.

How: the user's module gets an `__import__` of its own, which looks beside the file first. Meanwhile the copy's own
modules stand in `sys.modules`; afterwards they are removed.
"""

from __future__ import annotations

import ast
import builtins
import importlib
import os
import sys
import threading
import types
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import decode_source, spec_from_loader
from pathlib import Path, PurePosixPath
from typing import Any

from racecraft.contract.errors import SettingError, nearest

_lock = threading.RLock()
"""Held while a copy's modules stand in `sys.modules`."""


OWN_CODE, REFUSED = "RACECRAFT_OWN_CODE", "refuse"
"""An environment variable and its value where people who are not trusted give the files: no module of theirs runs."""
CONFINED = {OWN_CODE: REFUSED, "PYTHONSAFEPATH": "1"}
"""Variables of a command that runs in a folder of theirs: nothing there is taken for a module of Python's or ours."""
refuses_own_code: ContextVar[bool] = ContextVar("refuses_own_code", default=False)
"""The same for one request of a server, whose process serves its owner, too."""


def require_own_code(what: str) -> None:
    """Refuse to run a module that somebody brought, where the people who give the files are not trusted.

    Args:
        what: For the message: which module, of what.

    Raises:
        SettingError: They are not.
    """
    if refuses_own_code.get() or os.environ.get(OWN_CODE) == REFUSED:
        raise SettingError(
            "{what} is code of its own; expected networks, algorithms and environments that racecraft has. "
            "It would run with every right of this machine's owner.",
            what=what,
        )


def load_class(name: str, asked_by: str) -> Any:
    """Import "module:Class"; modules in the present folder are found, too.

    Raises:
        SettingError: There is no such module or class, the module fails, or modules of one's own are refused; the
            message says which.
    """
    require_own_code(f"{asked_by} {name}")
    module_name, _, attribute = name.partition(":")
    if not module_name or not attribute:
        raise SettingError(
            "{asked_by} {name!r} names no class; expected module:Class, such as my_module:MyClass.",
            asked_by=asked_by,
            name=name,
        )
    add_cwd_to_path()
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        raise SettingError(
            "{asked_by} {name}: there is no module '{name_2}'; expected one in this folder or installed.",
            asked_by=asked_by,
            name=name,
            name_2=error.name,
        ) from error
    except Exception as error:
        raise SettingError(
            "{asked_by} {name}: importing {module_name} failed ({error!r}). Mend the module.",
            asked_by=asked_by,
            name=name,
            module_name=module_name,
            error=error,
        ) from error
    found = getattr(module, attribute, None)
    if found is None:
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        raise SettingError(
            "{asked_by} {name}: {module_name} has no '{attribute}'. {hint}",
            asked_by=asked_by,
            name=name,
            module_name=module_name,
            attribute=attribute,
            hint=nearest(attribute, classes),
        )
    return found


def add_cwd_to_path() -> None:
    """Let modules in the present folder be imported, as `python -m` does and a console script does not."""
    if "" not in sys.path:
        sys.path.insert(0, "")


def imported_names(tree: ast.AST) -> set[str]:
    """Return the first names of the modules that are imported anywhere in a tree, in functions too."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found


def modules_beside(path: Path, tree: ast.Module) -> dict[str, str]:
    """Return the texts of the modules beside a file that it imports, and those import, by name such as "helpers/a.py".

    A module that is no text or no Python is left to the import, which says so.
    """
    folder = path.parent
    found: dict[str, str] = {}
    waiting = sorted(imported_names(tree))
    while waiting:
        name = waiting.pop()
        files = [folder / f"{name}.py"] if (folder / f"{name}.py").is_file() else sorted((folder / name).rglob("*.py"))
        for file in files if name not in sys.stdlib_module_names else ():
            key = file.relative_to(folder).as_posix()
            if key not in found and file != path:
                found[key] = decode_source(file.read_bytes())
                waiting += sorted(_imports_of(found[key]))
    return found


class UserModules:
    """Loads copies of a user's module.

    Args:
        path: The user's file; its name stands in tracebacks.
        code: The file, compiled.
        texts: The modules beside it, from `modules_beside`.
    """

    def __init__(self, path: Path, code: types.CodeType, texts: Mapping[str, str]) -> None:
        self.path, self.code, self.texts = path, code, texts
        self.tops = {PurePosixPath(name).parts[0].removesuffix(".py") for name in texts}
        """First names of the modules beside the file."""
        self._codes: dict[str, types.CodeType] = {}

    def load(self, name: str, print_line: Callable[..., None]) -> types.ModuleType:
        """Run the user's module, as a copy of its own.

        Args:
            name: What the module is called.
            print_line: Stands for `print` in it and in the modules beside it.

        Raises:
            BaseException: Whatever it raises.
        """
        module = types.ModuleType(name)
        module.__file__ = str(self.path)
        own = _OwnImports(self, print_line)
        vars(module).update(own.names)
        sys.modules[name] = module  # dataclasses and their like look their module up
        exec(self.code, vars(module))
        return module

    def file_of(self, name: str) -> tuple[str, bool] | None:
        """Return the file of a module by its dotted name, and whether it is a package; None where there is none."""
        stem = name.replace(".", "/")
        if f"{stem}.py" in self.texts:
            return f"{stem}.py", False
        if f"{stem}/__init__.py" in self.texts:
            return f"{stem}/__init__.py", True
        return ("", True) if any(file.startswith(f"{stem}/") for file in self.texts) else None

    def code_of(self, file: str) -> types.CodeType:
        """Return the code of a module beside the user's."""
        if file not in self._codes:
            self._codes[file] = compile(self.texts[file], str(self.path.parent / file), "exec", dont_inherit=True)
        return self._codes[file]


class _OwnImports(MetaPathFinder, Loader):
    """The modules of one copy: finds them, runs them, and keeps them out of everybody's way."""

    def __init__(self, modules: UserModules, print_line: Callable[..., None]) -> None:
        self._modules = modules
        self._mine: dict[str, types.ModuleType] = {}
        self.names: dict[str, Any] = {"print": print_line}
        """What stands in the module before it runs."""
        if modules.tops:
            self.names["__builtins__"] = {**vars(builtins), "__import__": self._import}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: types.ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module beside the user's."""
        found = self._modules.file_of(fullname)
        if found is None:
            return None
        spec = spec_from_loader(fullname, self, origin=str(self._modules.path.parent / found[0]), is_package=found[1])
        if spec is not None:
            spec.has_location = bool(found[0])
        return spec

    def exec_module(self, module: types.ModuleType) -> None:
        """Run a module beside the user's."""
        file, _ = self._modules.file_of(module.__name__) or ("", True)
        vars(module).update(self.names)
        if file:
            exec(self._modules.code_of(file), vars(module))

    def _import(self, name: str, *rest: Any) -> types.ModuleType:
        """Stand in for `__import__`."""
        level = rest[3] if len(rest) > 3 else 0
        if self in sys.meta_path or (level == 0 and name.partition(".")[0] not in self._modules.tops):
            return builtins.__import__(name, *rest)
        with _lock:
            others = {key: sys.modules.pop(key) for key in list(sys.modules) if self._is_beside(key)}
            sys.modules.update(self._mine)
            sys.meta_path.insert(0, self)
            try:
                return builtins.__import__(name, *rest)
            finally:
                sys.meta_path.remove(self)
                self._mine = {key: sys.modules.pop(key) for key in list(sys.modules) if self._is_beside(key)}
                sys.modules.update(others)

    def _is_beside(self, name: str) -> bool:
        return name.partition(".")[0] in self._modules.tops


def _imports_of(text: str) -> set[str]:
    try:
        return imported_names(ast.parse(text))
    except (SyntaxError, ValueError, RecursionError):
        return set()
