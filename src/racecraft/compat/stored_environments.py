"""A script's own environment in a run that lies elsewhere: the script travels, and is begun again up to its training.

Begin with `script_code` (when a training begins) and `begin_again` (when its run is judged). A launcher makes its
environment known while it runs, often by what it was told, so the script is run as it was: as the main program, with
its words and SageMaker's variables. Where it would train, its environment is known, and it is broken off.
"""

from __future__ import annotations

import ast
import contextlib
import os
import runpy
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path

from racecraft.compat.stored_models import OnlyReadError
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import modules_beside
from racecraft.training.custom_code import OwnCode
from racecraft.worlds.gymnasium.evaluation import REMADE_BY

REMADE = '''"""The environment of {file}, as it was when this run began; it is begun again where the run is judged."""

from racecraft.compat.stored_environments import begin_again

begin_again(__file__, {file!r}, {words!r}, {variables!r})
'''
VARIABLES = "SM_"
"""What variables begin with that tell a script of its job."""
_is_begun_again: ContextVar[bool] = ContextVar("is_begun_again", default=False)


def script_code(environment: str, by_name: bool = False) -> OwnCode:
    """Return what the main program's environment is remade from in a run's `code/`, or why it cannot be.

    Args:
        environment: What the script calls it.
        by_name: Whether modules are named rather than imported, as Coach's presets are; all that lie beside it then
            travel.
    """
    file = Path(getattr(sys.modules["__main__"], "__file__", None) or "")
    if file.suffix != ".py":
        return OwnCode(
            {},
            (f"{environment} cannot travel with the run, which is judged in this script only: it stands in no Python "
             "file; write it into one beside the notebook, and give that to `racecraft run`",),
        )  # fmt: skip
    text = file.read_text(encoding="utf-8")
    variables = {name: value for name, value in os.environ.items() if name.startswith(VARIABLES)}
    remade = REMADE.format(file=file.name, words=sys.argv[1:], variables=variables)
    beside = modules_beside(file, ast.parse(text))
    if by_name:
        beside |= {other.name: other.read_text(encoding="utf-8") for other in file.parent.glob("*.py")}
    return OwnCode({**beside, file.name: text, f"{REMADE_BY}.py": remade})


def exit_if_restarted() -> None:
    """Break a script off that was begun again for its environment, which is known by now.

    Raises:
        OnlyReadError: It was.
    """
    if _is_begun_again.get():
        raise OnlyReadError


def begin_again(beside: str, file: str, words: Sequence[str], variables: Mapping[str, str]) -> None:
    """Have the environment of a script that lies beside a file be known.

    Args:
        beside: A file in the script's folder.
        file: The script's name.
        words: What it was told when its training began.
        variables: SageMaker's, as they were then.

    Raises:
        SettingError: It fails, or does not come to its training.
    """
    from racecraft.compat.old_numpy import old_names
    from racecraft.compat.shims import as_main, foreign_names

    path = Path(beside).with_name(file)
    token = _is_begun_again.set(True)
    try:
        with foreign_names(), old_names(), as_main(path, words), _with(variables), contextlib.redirect_stdout(None):
            runpy.run_path(str(path), run_name="__main__")
    except OnlyReadError:
        return
    except Exception as error:
        raise SettingError(
            "{path}: begun again for its environment, it failed ({type_name}: {error}); expected what it "
            "came by when its training began.",
            path=path,
            type_name=type(error).__name__,
            error=error,
        ) from error
    finally:
        _is_begun_again.reset(token)
    raise SettingError(
        "{path}: begun again for its environment, it came to no training; expected it to, as it did.", path=path
    )


@contextlib.contextmanager
def _with(variables: Mapping[str, str]) -> Iterator[None]:
    """Set variables; afterwards they are as before."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
