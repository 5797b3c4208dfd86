"""A player from a user's own FILE.py, in the spirit of the official starter packs.

The file has a function `move(data)` that is given the official JSON as a dictionary and returns `{"move": "up"}` or
just `"up"`. It may also have `info()` (colour, head, tail), `start(data)` and `end(data)`. Its global names live as
long as the player. Loading a file runs it, with the rights of this process: load only what its owner asked to run.
"""

from __future__ import annotations

import sys
import tokenize
import traceback
import types
from pathlib import Path
from typing import Any

from racecraft.contract.errors import nearest
from racecraft.envs.battlesnake.board import MOVES
from racecraft.players.snakes.protocol import Message, PlayerError

_EXPECTED = 'expected a Python file with `def move(data):` that returns {"move": "up"}'


class FilePlayer:
    """A user's functions, ready to be called.

    Attributes:
        path: The file they came from.
    """

    def __init__(self, path: Path, module: types.ModuleType) -> None:
        self.path = path
        self._module = module

    def looks(self) -> dict[str, str]:
        """Return what the file's `info()` says, texts only; empty where there is none."""
        said = self._call("info") if callable(getattr(self._module, "info", None)) else {}
        if not isinstance(said, dict):
            raise PlayerError(f"{self.path}: info() returned a {type(said).__name__}; expected a dictionary.")
        return {str(key): str(value) for key, value in said.items()}

    def start(self, message: Message, seconds: float) -> None:
        """Tell the file that a game begins, if it wants to know."""
        if callable(getattr(self._module, "start", None)):
            self._call("start", message)

    def end(self, message: Message, seconds: float) -> None:
        """Tell the file that a game is over, if it wants to know."""
        if callable(getattr(self._module, "end", None)):
            self._call("end", message)

    def move(self, message: Message, seconds: float) -> str:
        """Return the file's move.

        Raises:
            PlayerError: It raised, or returned no move; names file and line.
        """
        answer = self._call("move", message)
        word = answer.get("move") if isinstance(answer, dict) else answer
        if not isinstance(word, str) or word not in MOVES:
            raise PlayerError(f"{self.path}: move() returned {answer!r:.80}; expected one of {', '.join(MOVES)}.")
        return word

    def _call(self, name: str, *arguments: Any) -> Any:
        try:
            return getattr(self._module, name)(*arguments)
        except (Exception, SystemExit) as error:
            raise PlayerError(_letter(self.path, f"{name}()", error)) from error


def load_file_player(path: str | Path) -> FilePlayer:
    """Load a user's file.

    Raises:
        PlayerError: It cannot be read, does not compile, fails while it is run, or has no `move`.
    """
    path = Path(path)
    try:
        with tokenize.open(path) as file:
            source = file.read()
        code = compile(source, str(path), "exec")
    except (OSError, UnicodeDecodeError) as error:
        raise PlayerError(f"{path}: cannot be read ({error}); {_EXPECTED}.") from error
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        raise PlayerError(f"{path}:{line}: {getattr(error, 'msg', error)}; {_EXPECTED}.") from error
    module = types.ModuleType("racecraft_snake_file")
    module.__file__ = str(path)
    _run(code, module, path)
    if not callable(getattr(module, "move", None)):
        names = [name for name, value in vars(module).items() if callable(value)]
        hint = nearest("move", names) if names else "It has no function."
        raise PlayerError(f"{path}: there is no move(data) in it; {_EXPECTED}. {hint}")
    return FilePlayer(path, module)


def _run(code: types.CodeType, module: types.ModuleType, path: Path) -> None:
    """Run the file with its own folder importable, so that helpers may stand beside it."""
    folder = str(path.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)
    try:
        exec(code, vars(module))
    except (Exception, SystemExit) as error:
        raise PlayerError(_letter(path, "loading it", error)) from error


def _letter(path: Path, what: str, error: BaseException) -> str:
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    place = f"{path}:{lines[-1]}" if lines else str(path)
    return f"{place}: {what} raised {type(error).__name__}: {str(error)[:200]}; {_EXPECTED}."
