"""The process in which a user's FILE.py lives: it loads the file, then answers one question a line until its end.

    in     {"ask": "move", "data": {…}}            also "info", "start", "end"
    out    {"answer": "up"}  or  {"error": "…"}    the first line tells that the file was loaded, or why not
           {"last_words": "…"}                     it wanted more memory than it may have, and the process ends

What the file prints goes to standard error. When the questions' pipe closes the process ends, whatever it is doing.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
import tokenize
import traceback
import types
from pathlib import Path
from typing import Any, TextIO

from racecraft.contract.errors import nearest
from racecraft.isolation.layers import restrict
from racecraft.isolation.readable import files_of_python
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.players.protocol import PlayerError

EXPECTED = 'expected a Python file with `def move(data):` that returns {"move": "up"}'


def main() -> None:
    """Answer for the file named on the command line."""
    path, memory_mb = Path(sys.argv[1]), int(sys.argv[2])
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what the file prints is no answer
    if "isolated" in sys.argv[3:]:
        next_question = sys.stdin.readline  # threads are denied, so its owner ends it where its owner ends
        restrict([*files_of_python(), str(path)], memory_mb << 20)
    else:
        questions: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=_listen, args=(questions,), daemon=True).start()
        next_question = questions.get
        limit_memory(memory_mb)
    try:
        module = load(path)
    except MemoryLimitError as error:
        _say(answers, {"last_words": _too_much(str(error), memory_mb)})
        return
    except PlayerError as error:
        _say(answers, {"error": str(error)})
        return
    _say(answers, {"answer": None})
    while question := next_question():
        request = json.loads(question)
        try:
            _say(answers, {"answer": answer(path, module, request["ask"], request["data"])})
        except MemoryLimitError as error:
            _say(answers, {"last_words": _too_much(str(error), memory_mb) + " It is begun anew."})
            os._exit(1)
        except PlayerError as error:
            _say(answers, {"error": str(error)})


class MemoryLimitError(PlayerError):
    """The file wanted more memory than it may have; the message says where."""


def limit_memory(memory_mb: int) -> None:
    """Hold this process's data (heap and private maps, not code) to a limit, where the system has one; 0: no limit."""
    if memory_mb and sys.platform == "linux":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        limit = memory_mb << 20
        resource.setrlimit(resource.RLIMIT_DATA, (limit if most < 0 else min(limit, most), most))


def lift_memory_limit() -> None:
    """Give back what the system allows, so that last words can be said."""
    if sys.platform == "linux":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def load(path: Path) -> types.ModuleType:
    """Run a file and return what it made.

    Raises:
        PlayerError: It cannot be read, does not compile, fails while it is run, or has no `move`.
    """
    try:
        with tokenize.open(path) as file:
            source = file.read()
        code = compile(source, str(path), "exec")
    except (OSError, UnicodeDecodeError) as error:
        raise PlayerError(
            "{path}: cannot be read ({problem}); {expected}.",
            path=path,
            problem=getattr(error, "strerror", None) or error,
            expected=EXPECTED,
        ) from error
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", None)
        raise PlayerError(
            "{path}:{line}: {problem}; {expected}.",
            path=path,
            line=line,
            problem=getattr(error, "msg", error),
            expected=EXPECTED,
        ) from error
    module = types.ModuleType("racecraft_snake_file")
    module.__file__ = str(path)
    sys.path.append(str(path.resolve().parent))  # helpers may stand beside it
    try:
        exec(code, vars(module))
    except MemoryError as error:
        lift_memory_limit()
        raise MemoryLimitError("{place}: loading it", place=_place(path, error)) from error
    except (Exception, SystemExit) as error:
        raise PlayerError(_error_text(path, "loading it", error)) from error
    if not callable(getattr(module, "move", None)):
        names = [name for name, value in vars(module).items() if callable(value)]
        hint = nearest("move", names) if names else "It has no function."
        raise PlayerError(
            "{path}: there is no move(data) in it; {expected}. {hint}", path=path, expected=EXPECTED, hint=hint
        )
    return module


def answer(path: Path, module: types.ModuleType, what: str, data: Any) -> Any:
    """Return what the file's function says: a move, its looks, or None where it need not say anything.

    Raises:
        PlayerError: It raised, or returned what is none; names file and line.
    """
    if not callable(getattr(module, what, None)):
        return {} if what == "info" else None
    try:
        reply = getattr(module, what)() if what == "info" else getattr(module, what)(data)
    except MemoryError as error:
        lift_memory_limit()
        raise MemoryLimitError("{place}: {what}()", place=_place(path, error), what=what) from error
    except (Exception, SystemExit) as error:
        raise PlayerError(_error_text(path, f"{what}()", error)) from error
    if what == "info":
        if not isinstance(reply, dict):
            raise PlayerError(
                "{path}: info() returned a {type_name}; expected a dictionary.",
                path=path,
                type_name=type(reply).__name__,
            )
        return {str(key): str(value) for key, value in reply.items()}
    return _move(path, reply) if what == "move" else None


def _move(path: Path, reply: Any) -> str:
    word = reply.get("move") if isinstance(reply, dict) else reply
    if not isinstance(word, str) or word not in MOVES:
        raise PlayerError(
            "{path}: move() returned {shown}; expected one of {moves}.",
            path=path,
            shown=_shown(reply),
            moves=", ".join(MOVES),
        )
    return word


def _shown(value: Any) -> str:
    try:
        return f"{value!r:.80}"
    except Exception:  # a user's __repr__ may fail
        return f"a {type(value).__name__}"


def _too_much(where: str, memory_mb: int) -> str:
    allowed = f"the {memory_mb} MB it may use" if memory_mb else "the machine has"
    return f"{where} wanted more memory than {allowed}. Keep less between moves, or give it more with --file-memory."


def _place(path: Path, error: BaseException) -> str:
    """Return the file and the line of it where an error was raised."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return f"{path}:{lines[-1]}" if lines else str(path)


def _error_text(path: Path, what: str, error: BaseException) -> str:
    return f"{_place(path, error)}: {what} raised {type(error).__name__}: {str(error)[:200]}; {EXPECTED}."


def _listen(questions: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        questions.put(line)
    os._exit(0)


def _say(answers: TextIO, value: dict[str, Any]) -> None:
    answers.write(json.dumps(value) + "\n")
    answers.flush()


if __name__ == "__main__":
    main()
