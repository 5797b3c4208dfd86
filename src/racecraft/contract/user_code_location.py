"""Which line of the user's own files an error came from. Begin with `user_code_location`."""

from __future__ import annotations

import functools
import os
import sysconfig
import traceback
from pathlib import Path

PACKAGES = {"site-packages", "dist-packages"}
"""Where packages lie: those of this Python, of the user and of another environment that this one looks into."""
_OURS = str(Path(__file__).resolve().parents[1])


def user_code_location(error: BaseException) -> str:
    """Return "file:line" of the innermost line that is the user's own; "" where none is.

    The user's own is what belongs neither to racecraft nor to Python nor to an installed package. Files in the present
    folder are told as they are called there.
    """
    if isinstance(error, SyntaxError) and error.filename and error.lineno:
        return f"{display_path(error.filename)}:{error.lineno}"
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if is_user_file(frame.filename):
            return f"{display_path(frame.filename)}:{frame.lineno}"
    return ""


def is_user_file(file: str) -> bool:
    """Tell whether a file is the user's."""
    real = os.path.realpath(file)
    return not file.startswith("<") and not real.startswith(_installed()) and not PACKAGES & set(Path(real).parts)


def display_path(file: str) -> str:
    """Return a file's name as a person in the present folder would say it."""
    return os.path.relpath(file) if Path(file).is_relative_to(Path.cwd()) else file


@functools.cache
def _installed() -> tuple[str, ...]:
    places = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "platlib", "purelib")}
    return (_OURS + os.sep, *(os.path.realpath(place) + os.sep for place in places))
