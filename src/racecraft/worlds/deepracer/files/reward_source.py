"""What a reward file says, before it is run: its text, its code, the modules beside it, and what they tell.

Begin with `read_reward_source`.
"""

from __future__ import annotations

import ast
import tokenize
import types
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

from racecraft.contract.errors import RewardFileError
from racecraft.contract.loading import modules_beside
from racecraft.contract.message import Message
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.run_folder import REWARD_FUNCTION
from racecraft.formats.user_file import SAVE_AS_UTF8, looks_utf16, not_utf8, read_user_file, typing_hint
from racecraft.worlds.deepracer.files.reward_analysis import RewardAnalysis, analyse

KIND = "a Python file with `def reward_function(params):` that returns a number"
PACKAGES = {"cv2": "opencv-python-headless", "PIL": "pillow", "skimage": "scikit-image", "sklearn": "scikit-learn"}
"""What is installed under another name than it is imported by."""

MAX_REWARD_BYTES = 16 * 2**20
"""AWS's consoles take 140,000 characters; a racing line in the file may be longer."""


@dataclass(frozen=True)
class RewardSource:
    """A reward file that was read."""

    path: Path
    text: str
    code: types.CodeType
    analysis: RewardAnalysis
    modules: Mapping[str, str] = field(default_factory=dict)
    """The modules beside it that it needs: texts by name, such as "racing_line.py" and "helpers/a.py"."""

    @property
    def tree(self) -> ast.Module:
        """The file, parsed anew."""
        return ast.parse(self.text.removeprefix("\ufeff"))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is worth telling its author, a clause each."""
        return tuple(f"{self.path.name}:{remark.line}: {remark.text}" for remark in self.analysis.remarks)


def read_reward_source(path: str | Path) -> RewardSource:
    """Read a reward file and the modules beside it; nothing is run.

    Raises:
        RewardFileError: The file is missing or empty, or is no Python.
    """
    path = Path(path)
    text = _read(path)
    tree, code = _parsed(path, text)
    try:
        return RewardSource(path, text, code, analyse(tree), modules_beside(path, tree))
    except (SyntaxError, UnicodeDecodeError, OSError) as error:
        raise RewardFileError(
            path, Message("a module beside it cannot be read ({error})", error=error), "modules in UTF-8"
        ) from None


def source_of(path: str | Path, text: str, modules: Mapping[str, str]) -> RewardSource:
    """Return what was read elsewhere, as `read_reward_source` did there.

    Raises:
        RewardFileError: It is no Python.
    """
    path = Path(path)
    tree, code = _parsed(path, text)
    return RewardSource(path, text, code, analyse(tree), modules)


def write_reward(source: RewardSource, folder: Path) -> None:
    """Write a reward file as it was read, and the modules beside it, into a folder from which it can be loaded again.

    Raises:
        OutputFileError: A file cannot be written.
    """
    for name, text in source.modules.items():
        make_folder((folder / name).parent)
        write_atomic(folder / name, text)
    write_atomic(folder / REWARD_FUNCTION, source.text)


def how_to_install(name: str, path: Path) -> str:
    """Return what to do about a module that is missing."""
    top = name.partition(".")[0]
    package = PACKAGES.get(top, top)
    return (
        f"Install '{top}' into this environment with `python -m pip install {package}`, or put {top}.py beside "
        f"{path.name}."
    )


def _read(path: Path) -> str:
    hint = "`racecraft new` writes one to begin with."
    data = read_user_file(path, RewardFileError, KIND, hint, MAX_REWARD_BYTES)
    if looks_utf16(data) or data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise not_utf8(path, data, 0, RewardFileError)
    if not data.strip():
        raise RewardFileError(path, "the file is empty", KIND, hint)
    try:
        encoding, _ = tokenize.detect_encoding(BytesIO(data).readline)
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise not_utf8(path, data, error.start, RewardFileError) from None
    except (SyntaxError, LookupError) as error:
        raise _unknown_encoding(path, data, error) from None


def _unknown_encoding(path: Path, data: bytes, error: Exception) -> RewardFileError:
    """Return the error about a file whose first two lines name an encoding that it is not in, or that nobody knows."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as wrong:
        if "unknown encoding" not in str(error):
            return not_utf8(path, data, wrong.start, RewardFileError)
    return RewardFileError(
        path, Message("no text that Python reads ({error})", error=error), "a text file in UTF-8", SAVE_AS_UTF8
    )


def _parsed(path: Path, text: str) -> tuple[ast.Module, types.CodeType]:
    text = text.removeprefix("\ufeff")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            warnings.simplefilter("ignore", DeprecationWarning)
            return ast.parse(text, str(path)), compile(text, str(path), "exec", dont_inherit=True)
    except SyntaxError as error:
        line = (error.text or "").strip()
        near = f" in `{line}`" if line else ""
        hint = typing_hint(error.text or "")
        raise RewardFileError(
            path, Message("{msg}{near}", msg=error.msg, near=near), "valid Python", hint, line=error.lineno
        ) from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise RewardFileError(path, Message("no Python ({error})", error=error), "valid Python") from None
