"""Which line of a script a letter is about: where the refused word stands, else what asked. Begin with `placed`."""

from __future__ import annotations

import ast
import linecache
import re
import traceback

from racecraft.contract.errors import UserInputError
from racecraft.contract.user_code_location import display_path, is_user_file

_HAS_PLACE = re.compile(r"^(?:[A-Za-z]:)?[^:\n]+:\d+: ")
_QUOTED = re.compile(r"'([^']+)'")


def placed(error: UserInputError) -> str:
    """Return a letter with the line of the script that it is about; as it is where it names one, or none led to it."""
    message = str(error)
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if is_user_file(frame.filename)]
    if not own or _HAS_PLACE.match(message):
        return message
    file, word = own[-1].filename, _QUOTED.search(message.partition(" Did you mean ")[0])
    words = (word[1], word[1].rpartition(".")[2]) if word else ()
    lines = [line for line in (line_of_word(file, one) for one in words) if line]
    return f"{display_path(file)}:{lines[0] if lines else own[-1].lineno}: {message}"


def line_of_word(file: str, word: str) -> int | None:
    """Return the line where a text, or an argument's name, stands alone in a file; None where it stands at two or none.

    Args:
        file: As Python calls it; a notebook's cell, too.
        word: The whole text.
    """
    try:
        tree = ast.parse("".join(linecache.getlines(file)))
    except (SyntaxError, ValueError):
        return None
    lines = {node.lineno for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == word}
    lines |= {node.lineno for node in ast.walk(tree) if isinstance(node, ast.Constant) and node.value == word}
    return lines.pop() if len(lines) == 1 else None
