"""Arguments of functions that stand for somebody else's. Begin with `require_arguments`.

Such a function takes whatever the original takes and needs little of it. It keeps a table of the original's names
beside it: those are written down or passed over, and any other is refused with the nearest, for it was typed wrong.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable

from racecraft.contract.errors import SettingError, nearest


def require_arguments(function: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse arguments that no version of a function has.

    Args:
        function: As a script calls it.
        given: Names of arguments.
        known: Names that any version of the original takes. One that begins with "_" is its own affair.

    Raises:
        SettingError: An unknown name; the nearest known one is told.

    >>> require_arguments("ray.init", ["num_cpuss"], ["address", "num_cpus"])
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: ray.init has no argument 'num_cpuss'. Did you mean 'num_cpus'?
    """
    names = sorted(known)
    for name in given:
        if name not in names and not name.startswith("_"):
            raise SettingError(
                "{function} has no argument '{name}'. {hint}", function=function, name=name, hint=nearest(name, names)
            )


def names_of(function: Callable[..., object]) -> list[str]:
    """Return the arguments that a function names.

    >>> names_of(lambda first, *others, second=2, **recorded: None)
    ['first', 'second']
    """
    several = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [name for name, one in inspect.signature(function).parameters.items() if one.kind not in several]
