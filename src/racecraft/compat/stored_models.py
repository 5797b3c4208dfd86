"""A script's own network in a run that lies elsewhere: the script's file travels, and is read again for its class.

Begin with `texts_of` (when a training begins) and `read_class` (when its policy is made again). Reading runs the file
as an import would, foreign names lent; a training that it begins at its top is broken off.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
import sys
import types
from collections.abc import Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.contract.loading import modules_beside

REMADE = '''"""The network of {file}, as it was when this run began; it is read again where the policy is made."""

from racecraft.compat.script_models import model_of
from racecraft.compat.stored_models import read_class

Model = model_of(read_class(__file__, {file!r}, {name!r}), {told!r})
'''
_reading: ContextVar[bool] = ContextVar("reading", default=False)


class OnlyReadError(BaseException):
    """A script that is only read wants to train; no `except Exception` of its own may hold it up."""


def texts_of(made_by: type, module: str, config: Mapping[str, Any]) -> dict[str, str] | str:
    """Return the texts from which a model is remade in a run's `code/`, by file; or why it cannot be, as a clause.

    Args:
        made_by: The script's class.
        module: What the module is called in which racecraft finds it.
        config: Its configuration.
    """
    name, file = made_by.__qualname__, Path(getattr(sys.modules.get(made_by.__module__), "__file__", None) or "")
    cannot = f"custom_model {name} cannot travel with the run, which is judged in this script only: "
    if file.suffix != ".py":
        return f"{cannot}it stands in no Python file; write it into one beside the notebook, and import it"
    if "<locals>" in name:
        return f"{cannot}it is made within a function; write its class at the top of {file.name}"
    if not _is_plain(config):
        return f"{cannot}config.model holds more than numbers and text; make the rest in the class"
    text = file.read_text(encoding="utf-8")
    beside = modules_beside(file, ast.parse(text))
    remade = REMADE.format(file=file.name, name=name, told=dict(config))
    return {**beside, file.name: text, f"{module}.py": remade}


def read_class(beside: str, file: str, name: str) -> type:
    """Return a class of a script that lies beside a file; run it for that, as an import would.

    Raises:
        SettingError: It fails, or has no such class any more.
    """
    from racecraft.compat.shims import foreign_names

    path = Path(beside).with_name(file)
    module = types.ModuleType(path.stem)
    module.__dict__.update({"__file__": str(path), "__builtins__": builtins})
    before = sys.modules.get(path.stem)
    sys.modules[path.stem] = module
    token = _reading.set(True)
    try:
        with foreign_names(), contextlib.suppress(OnlyReadError):
            exec(compile(path.read_bytes(), str(path), "exec"), module.__dict__)
    except Exception as error:
        raise SettingError(
            "{path}: reading its class {name} failed ({type_name}: {error}).",
            path=path,
            name=name,
            type_name=type(error).__name__,
            error=error,
        ) from error
    finally:
        _reading.reset(token)
        if before is not None:
            sys.modules[path.stem] = before
        else:
            del sys.modules[path.stem]
    found: Any = module
    for part in name.split("."):
        found = getattr(found, part, None)
    if not isinstance(found, type):
        raise SettingError(
            "{path}: there is no class {name}; expected the file as it was when the run began.", path=path, name=name
        )
    return found


def refuse_to_train() -> None:
    """Break a script off that is only read for its classes.

    Raises:
        OnlyReadError: It is.
    """
    if _reading.get():
        raise OnlyReadError


def _is_plain(config: Mapping[str, Any]) -> bool:
    try:
        return bool(ast.literal_eval(repr(dict(config))) == dict(config))
    except (ValueError, SyntaxError, TypeError):
        return False
