"""`training_params.yaml` and `evaluation_params.yaml`: what DeepRacer for Cloud tells its simulator.

Begin with `write_params` and `read_params`. The files are YAML: keys, and texts or lists of texts as values (one
for each car of an evaluation).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.user_file import read_user_text

Params = dict[str, str | list[str]]

MAX_CHARACTERS = 1 << 17
"""Of a file of settings; PyYAML takes seconds for more."""
_KIND = "lines of KEY: 'value', or KEY: and a list of - 'value'"


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
    write_atomic(path, "\n".join(lines) + "\n")


def read_params(path: str | Path) -> Params:
    """Read keys and values, all as text.

    Raises:
        ParamsFileError: The file is missing, not UTF-8 text, or as for `parse_params`.
    """
    path = Path(path)
    return parse_params(read_user_text(path, ParamsFileError, _KIND, may_be_empty=True), path)


def parse_params(text: str, name: str | Path) -> Params:
    """Return keys and values of a file's text, all as text.

    Args:
        text: The text.
        name: The file, as errors name it.

    Raises:
        ParamsFileError: It is not YAML, or a value is neither text nor a list of texts.
    """
    import yaml  # type: ignore[import-untyped,unused-ignore]

    if len(text) > MAX_CHARACTERS:
        raise ParamsFileError(name, Message("{count:,} characters", count=len(text)), _KIND)
    try:
        params = yaml.load(text, Loader=yaml.BaseLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        raise ParamsFileError(name, str(error.problem), _KIND, line=mark.line + 1 if mark else None) from error
    except (yaml.YAMLError, RecursionError) as error:
        raise ParamsFileError(name, Message("not YAML ({error})", error=str(error)[:80]), _KIND) from error
    if not params:
        return {}
    if not isinstance(params, dict):
        raise ParamsFileError(name, Message("a YAML {type_name}", type_name=type(params).__name__), _KIND)
    for key, value in params.items():
        texts = value if isinstance(value, list) else [value]
        if not isinstance(key, str) or not all(isinstance(text, str) for text in texts):
            raise ParamsFileError(name, "a nested value", _KIND, key=str(key)[:60])
    return params


def _quoted(value: object) -> str:
    return "'" + str(value).replace("'", "''") + "'"
