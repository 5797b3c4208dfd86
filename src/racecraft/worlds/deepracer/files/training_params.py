"""`training_params.yaml` and `evaluation_params.yaml`: what DeepRacer for Cloud tells its simulator.

Begin with `write_params` and `read_params`. The files use a sliver of YAML: one key a line, quoted text as value or a
list of it (one for each car of an evaluation); we write and read that sliver, and need no YAML library for it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from racecraft.contract.errors import InputFileError
from racecraft.formats.whole import write_whole

Params = dict[str, str | list[str]]

_KIND = "lines of KEY: 'value', or KEY: and a list of - 'value'"
_KEY = re.compile(r"([A-Za-z_][\w.]*)\s*:(?:\s+(.*))?$")
_INLINE = re.compile(r"""'(?:[^']|'')*'|"[^"]*"|[^,\s][^,]*""")


class ParamsFileError(InputFileError):
    """A params file is missing or holds what is no list of keys and texts."""


def write_params(path: str | Path, params: Mapping[str, object]) -> None:
    """Write keys and values; every value becomes quoted text, every list a list of quoted texts.

    Raises:
        OutputFileError: The file cannot be written.
    """
    lines = ["---"]
    for key, value in params.items():
        if isinstance(value, Sequence) and not isinstance(value, str):
            lines += [f"{key}:" if value else f"{key}: []", *(f"- {_quoted(part)}" for part in value)]
        else:
            lines.append(f"{key}: {_quoted(value)}")
    write_whole(path, "\n".join(lines) + "\n")


def read_params(path: str | Path) -> Params:
    """Read keys and values, all as text.

    Raises:
        ParamsFileError: The file is missing, no text, or a line is none of the kinds above; the letter names it.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ParamsFileError(path, "there is no such file", _KIND) from None
    except UnicodeDecodeError:
        raise ParamsFileError(path, "the file is no UTF-8 text", _KIND) from None
    except OSError as error:
        raise ParamsFileError(path, f"the file cannot be read ({error.strerror})", _KIND) from error
    params: Params = {}
    key = ""
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.strip()
        if not stripped or stripped == "---" or stripped.startswith("#"):
            continue
        match = _KEY.match(stripped)
        under = params.get(key)
        if match and not stripped.startswith("-"):
            key = match[1]
            params[key] = _value((match[2] or "").strip())
        elif stripped.startswith("- ") and (isinstance(under, list) or under == ""):
            params[key] = [*(under or []), _unquoted(stripped[2:].strip())]
        else:
            raise ParamsFileError(path, f"{stripped[:60]!r}", _KIND, line=number)
    return params


def _value(text: str) -> str | list[str]:
    if text.startswith("[") and text.endswith("]"):
        return [_unquoted(part.strip()) for part in _INLINE.findall(text[1:-1].strip())]
    return _unquoted(text)


def _quoted(value: object) -> str:
    return "'" + str(value).replace("'", "''") + "'"


def _unquoted(text: str) -> str:
    if len(text) > 1 and text[0] == text[-1] == "'":
        return text[1:-1].replace("''", "'")
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1].replace('\\"', '"').replace("\\\\", "\\")
    return re.sub(r"\s+#.*$", "", text)
