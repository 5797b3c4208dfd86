"""A name that a script asks for and nobody has, as an error with the script's line. Begin with `name_error_message`.

Python tells such an error by the name of our module behind the foreign one, and by lines of ours. What is wrong in the
script alone, such as a division by zero or a name that it forgot to set, is left as Python tells it.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import sys
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from racecraft.compat.call_errors import about_call
from racecraft.compat.source_lines import placed
from racecraft.compat.undefined_names import HINTS, sentence
from racecraft.contract.errors import RacecraftError, UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.contract.user_code_location import is_user_file, user_code_location

HOME = "racecraft.compat.names"
"""Where the modules stand whose names are lent."""
DOCS = "The page 'Your old SageMaker notebook' says what is lent."
UNREGISTERED = "UnregisteredEnv"
"""What Gymnasium raises of an environment that it does not know, and names the nearest itself."""
_IMPORTED = re.compile(r"cannot import name '(\w+)'")


class UnknownNameError(UserInputError):
    """A script asks for something by a name that neither `racecraft run` nor anybody else here has."""


@contextlib.contextmanager
def name_error_message(lent: Sequence[str]) -> Iterator[None]:
    """Tell what a script asks for and nobody has by a letter, and lay its own line before letters of ours.

    All other errors go through as they are.

    Args:
        lent: Modules that are lent, by their foreign names.

    Raises:
        UnknownNameError: It asked for such a name.
    """
    try:
        yield
    except Exception as error:
        message = error_about(error, lent)
        if message and isinstance(error, UserInputError):
            error.message = Message(message)
        elif message:
            raise UnknownNameError(message) from error
        raise


def error_about(error: BaseException, lent: Sequence[str]) -> str:
    """Return the error about what the user's own code asked for, with its line; "" where Python tells it better.

    Args:
        error: As Python raised it.
        lent: Modules that are lent, by their foreign names.
    """
    message = ""
    if isinstance(error, UserInputError):
        return placed(error)
    if isinstance(error, RacecraftError):
        message = str(error) if isinstance(error, AttributeError) else ""
    elif any(kind.__name__ == UNREGISTERED for kind in type(error).__mro__):
        message = f"{error} Register it before, or take one that is there."
    elif not _is_requested_by_user(error):
        return ""
    elif isinstance(error, NameError):
        message = sentence(error.name) if error.name in HINTS else ""
    elif isinstance(error, ModuleNotFoundError):
        message = _about_module(error.name or "", error, lent)
    elif isinstance(error, ImportError):
        imported = _IMPORTED.match(str(error))
        message = _about_name(imported[1], error.name or "", _offered_by_module(error.name)) if imported else ""
    elif isinstance(error, AttributeError) and error.obj is not None:
        message = _about_attribute(error.name or str(error), error.obj)
    elif isinstance(error, TypeError):
        message = about_call(error)
    return f"{user_code_location(error)}: {message}" if message else ""


def offered_by(module: ModuleType) -> list[str]:
    """Return what a lent module offers."""
    named = getattr(module, "__all__", None)
    return sorted(named or (name for name, value in vars(module).items() if _is_of(value, module.__name__)))


def _is_of(value: Any, module: str) -> bool:
    """Tell whether something was made in a module, or is a module within it."""
    name = value.__name__ if isinstance(value, ModuleType) else f"{getattr(value, '__module__', '')}."
    return not getattr(value, "__name__", "_").startswith("_") and name.startswith(f"{module}.")


def _is_requested_by_user(error: BaseException) -> bool:
    """Tell whether the user's own code asked for a name, and not somebody whom it called."""
    if not (frames := [frame for frame in traceback.extract_tb(error.__traceback__) if not _answers(frame)]):
        return False
    return is_user_file(frames[-1].filename)


def _answers(frame: traceback.FrameSummary) -> bool:
    """Tell whether a line belongs to the looking up of a name."""
    return frame.name in ("__getattr__", "find_spec") or frame.filename.startswith("<frozen importlib")


def _about_module(name: str, error: BaseException, lent: Sequence[str]) -> str:
    top = name.partition(".")[0]
    if top in lent:
        return f"`racecraft run` lends no module {name}. {_nearest_module(name, lent)} {DOCS}"
    if _is_installed(top):
        return f"the {top} that is installed has no module {name}. Import what it has, or install another version."
    near = nearest(name, [*(one for one in lent if "." not in one), *_neighbours(error)])
    meant = f"{near} If not, " if near.startswith("Did") else "If it is a package, "
    return (
        f"there is no module {name}: `racecraft run` lends none, none stands beside the script and none is installed. "
        f"{meant}install it beside racecraft: pip install {top}"
    )


def _nearest_module(name: str, lent: Sequence[str]) -> str:
    """Return the clause about those of a package's modules that stand where one was looked for."""
    place = name.rpartition(".")[0]
    while place and place not in lent:
        place = place.rpartition(".")[0]
    within = [one.removeprefix(f"{place}.") for one in lent if one.startswith(f"{place}.")]
    near = nearest(name.removeprefix(f"{place}."), within)
    return f"Of {place}: {near}" if within else f"{place} is no package here."


def _is_installed(top: str) -> bool:
    with contextlib.suppress(ImportError, ValueError):
        return importlib.util.find_spec(top) is not None
    return False


def _neighbours(error: BaseException) -> list[str]:
    """Return the modules that stand beside the file that asked."""
    own = [frame.filename for frame in traceback.extract_tb(error.__traceback__) if is_user_file(frame.filename)]
    return sorted(path.stem for path in Path(own[-1]).resolve().parent.glob("*.py") if str(path) != own[-1])


def _about_attribute(name: str, obj: Any) -> str:
    """Return what is wrong with asking something lent, or racecraft itself, for a name; "" of anything else."""
    if isinstance(obj, ModuleType):
        return _about_name(name, obj.__name__, offered_by(obj))
    kind = obj if isinstance(obj, type) else type(obj)
    if not kind.__module__.startswith("racecraft."):
        return ""
    return f"{kind.__name__} has no {name} here. {nearest(name, [one for one in dir(kind) if one[0] != '_'])}"


def _offered_by_module(name: str | None) -> list[str]:
    module = sys.modules.get(name or "")
    return [] if module is None else offered_by(module)


def _about_name(name: str, of: str, offered: Sequence[str]) -> str:
    """Return what is wrong with a name of a module that is lent, or of racecraft itself; "" of any other."""
    near = nearest(name, offered) if offered else "It lends nothing of it."
    if of.startswith(f"{HOME}."):
        return f"`racecraft run` lends no {of.removeprefix(f'{HOME}.')}.{name}. {near} {DOCS}"
    return f"{of} has no {name}. {near}" if of.partition(".")[0] == "racecraft" else ""
