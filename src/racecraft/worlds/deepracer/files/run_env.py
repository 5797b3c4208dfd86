"""`system.env`, `run.env`, `worker-N.env`: the settings of DeepRacer for Cloud, as users bring them.

Begin with `read_run_env` (one file after the other, the later one wins) or `read_env_folder` (a whole installation).
Files are read as they come: Windows line ends, a byte order mark, `export`, quotes of any shape, remarks behind a
value, `$OTHER` variables. Old and mistaken names are read as what they mean; a name nobody knows is kept and named
with the nearest known one. `edit_run_env` changes values in place and keeps the rest, a copy as `.bak` beside it.

The table of variables is `run_env_variables.py`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from racecraft.contract.errors import Faults, InputFileError, nearest
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.user_file import read_user_text
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME, ENV_VARIABLES, OTHER_SPELLINGS

_KIND = "lines of KEY=VALUE"
_LINE = re.compile(r"\s*(?:export\s+)?([A-Za-z_][A-Za-z0-9_]*)\s*=\s*(.*?)\s*$")
_VARIABLE = re.compile(r"\$(?:\{([A-Za-z_][A-Za-z0-9_]*)\}|([A-Za-z_][A-Za-z0-9_]*))")
_PLACEHOLDER = re.compile(r"<[A-Z_]+>|(?:not|to-be)-defined|found-\d+-buckets")
"""What DeepRacer for Cloud's templates hold, and what its init.sh writes where it found no bucket, or several."""
_QUOTES = {
    '"': '"',
    "'": "'",
    "\u201c": "\u201d\u201c",
    "\u201d": "\u201d\u201c",
    "\u2018": "\u2019\u2018",
    "\u2019": "\u2019",
}
_OPENING = ('"', "'", "\u201c", "\u201d", "\u2018")
"""Quotes that want an end; a single \u2019 may be an apostrophe."""
_BROKEN = "unclosed"
_REMARKS = {"told": " (changes no training)", "without": " (not applicable here)"}
"""What a new file says of variables that it need not say anything with, by their status."""
_PART_OF = {"DR_LOCAL_S3_PRETRAINED_PREFIX": ("DR_LOCAL_S3_PRETRAINED",)}
"""Variables that mean nothing without another one."""
_TRUE, _FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off", "")


class RunEnvError(InputFileError):
    """A file of settings is missing, or a line or value in it cannot be used."""


@dataclass(frozen=True)
class RunEnv:
    """Settings that were read, by the names that DeepRacer for Cloud itself uses."""

    values: Mapping[str, str] = field(default_factory=dict)
    """Text by name, variables filled in. What is empty or was never filled in is not here."""
    locations: Mapping[str, tuple[Path, int | None]] = field(default_factory=dict)
    """File and line of each value; no line where it comes from no file."""
    notes: tuple[str, ...] = ()
    """What is worth telling the user, a clause each."""

    def text(self, name: str, default: str = "") -> str:
        """Return a value as it is."""
        return self.values.get(name, default)

    def flag(self, name: str, default: bool = False) -> bool:
        """Return a value as true or false, in any spelling.

        Raises:
            RunEnvError: It is neither; the message names file and line.
        """
        if name not in self.values:
            return default
        folded = self.values[name].casefold()
        if folded not in _TRUE + _FALSE:
            raise self.error_at(name, "True or False")
        return folded in _TRUE

    def number(self, name: str, default: float, low: float, high: float) -> float:
        """Return a value as a number from low to high.

        Raises:
            RunEnvError: It is none; the message names file and line.
        """
        if name not in self.values:
            return default
        try:
            number = float(self.values[name])
        except ValueError:
            number = float("nan")
        if not low <= number <= high:
            raise self.error_at(name, Message("a number from {low:g} to {high:g}", low=low, high=high))
        return number

    def choice(self, name: str, default: str, known: tuple[str, ...]) -> str:
        """Return a value that is one of the known words, in any case.

        Raises:
            RunEnvError: It is none of them; the message names file and line, and the nearest.
        """
        if name not in self.values:
            return default
        for word in known:
            if word.casefold() == self.values[name].casefold():
                return word
        raise self.error_at(name, " or ".join(known), nearest(self.values[name], known))

    def error_at(
        self, name: str, expected: str | Message, hint: str | Message = "", found: str | Message = ""
    ) -> RunEnvError:
        """Return the error about a value, with its file and line."""
        path, line = self.locations[name]
        return RunEnvError(
            path, found or Message("'{values}'", values=self.values[name]), expected, hint, line=line, key=name
        )


@dataclass(frozen=True)
class EnvFolder:
    """The settings of a whole installation."""

    run: RunEnv
    """`system.env` and `run.env` together."""
    workers: Mapping[int, RunEnv]
    """What `worker-N.env` changes for worker N, from 2 on."""

    def without(self, error: RunEnvError) -> EnvFolder:
        """Return the settings without the value that an error is about; the same where it is about none of them."""

        def left(env: RunEnv) -> RunEnv:
            if env.locations.get(error.key or "") != (error.path, error.line):
                return env
            dropped = (error.key, *_PART_OF.get(error.key or "", ()))
            return replace(env, values={name: value for name, value in env.values.items() if name not in dropped})

        return EnvFolder(left(self.run), {number: left(worker) for number, worker in self.workers.items()})


def read_run_env(*paths: str | Path, expand: bool = True, faults: Faults | None = None) -> RunEnv:
    """Read files of settings, the later one over the earlier.

    Args:
        paths: The files, usually system.env and run.env.
        expand: Whether `$OTHER` is filled in; DeepRacer for Cloud does not in worker files.
        faults: Where lines that are no setting are collected and left out; None: they are raised.

    Raises:
        RunEnvError: A file is missing or no text, or a line is no setting; the message names file and line.
        SeveralFaultsError: Several lines are none.
    """
    values: dict[str, str] = {}
    places: dict[str, tuple[Path, int | None]] = {}
    notes: list[str] = []
    found = Faults() if faults is None else faults
    for path in map(Path, paths):
        for number, line in enumerate(_lines(path), 1):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            where = f"{path.name}:{number}"
            with found.collect():
                written, value, quote = _setting_on(line, path, number)
                name = _known_name(written, where, notes)
                if expand and quote not in ("'", "\u2018"):
                    value = _filled_in(value, values, where, notes)
                values.pop(name, None)
                if _PLACEHOLDER.fullmatch(value):
                    notes.append(f"{where}: {name} still holds {value}; it counts as not given")
                elif value:
                    values[name], places[name] = value, (path, number)
    if faults is None:
        found.raise_found()
    return RunEnv(values, places, tuple(notes))


def read_env_folder(folder: str | Path, faults: Faults | None = None) -> EnvFolder:
    """Read the settings of an installation: system.env where there is one, run.env, and worker-N.env.

    Args:
        folder: Where they lie.
        faults: Where lines that are no setting are collected and left out; None: they are raised.

    Raises:
        RunEnvError: There is no run.env, or a file in it cannot be used.
    """
    folder = Path(folder)
    paths = [folder / "system.env"] if (folder / "system.env").is_file() else []
    return read_env_files(*paths, folder / "run.env", workers=folder, faults=faults)


def read_env_files(*paths: str | Path, workers: Path | None = None, faults: Faults | None = None) -> EnvFolder:
    """Read the settings of an installation from files that are named, the later one over the earlier.

    Args:
        paths: Usually system.env and run.env.
        workers: Where worker-N.env files lie; None: none are read.
        faults: Where lines that are no setting are collected and left out; None: they are raised.

    Raises:
        RunEnvError: A file is missing or damaged.
    """
    found = {}
    for path in sorted(workers.glob("worker-*.env")) if workers is not None else ():
        number = path.stem.removeprefix("worker-")
        if number.isdecimal():
            found[int(number)] = read_run_env(path, expand=False, faults=faults)
    return EnvFolder(read_run_env(*paths, faults=faults), found)


def without_curly_quotes(text: str) -> str:
    """Return a value as it was meant where it was pasted from a page into a shell, which knows straight quotes only.

    >>> without_curly_quotes("\u201dmy-model\u201d"), without_curly_quotes("it\u2019s")
    ('my-model', 'it\u2019s')
    """
    closing = _QUOTES.get(text[:1], "") if text[:1] not in ('"', "'") else ""
    return text[1:-1] if len(text) > 1 and closing and text[-1] in closing else text


def edit_run_env(path: str | Path, changes: Mapping[str, str]) -> None:
    """Change values in a file of settings; all else stays as it is, and the old file is kept as `<name>.bak`.

    A value whose name is not there yet is added at the end.

    Raises:
        RunEnvError: The file is missing or no text.
        OutputFileError: The file cannot be written.
    """
    path = Path(path)
    lines, left = _lines(path), dict(changes)
    for number, line in enumerate(lines):
        match = None if line.lstrip().startswith("#") else _LINE.match(line)
        if match is None:
            continue
        name = OTHER_SPELLINGS.get(match[1], match[1])
        if name in changes:
            lines[number] = f"{line[: match.start(2)]}{_quoted_if_needed(changes[name])}"
            left.pop(name, None)
    while lines and not lines[-1].strip():
        lines.pop()
    lines += [f"{name}={_quoted_if_needed(value)}" for name, value in left.items()]
    write_atomic(path.with_name(path.name + ".bak"), path.read_bytes())
    write_atomic(path, "\n".join(lines) + "\n")


def run_env_text(file: str = "run") -> str:
    """Return a new file of settings, "run" or "system", with each variable, its default and one remark."""
    out = []
    for variable in ENV_VARIABLES:
        if variable.file == file:
            out.append(f"# {variable.doc}{_REMARKS.get(variable.status, '')}")
            out.append(f"{'' if variable.default else '#'}{variable.name}={variable.default}")
    return "\n".join(out) + "\n"


def next_prefix(prefix: str, delimiter: str = "-") -> str:
    """Return the name of the training after this one: the number at its end, one higher.

    >>> next_prefix("fast-car-9"), next_prefix("fast-car")
    ('fast-car-10', 'fast-car-1')
    """
    head, found, tail = prefix.rpartition(delimiter)
    if found and tail.isdecimal():
        return f"{head}{delimiter}{int(tail) + 1}"
    return f"{prefix}{delimiter}1"


def _lines(path: Path) -> list[str]:
    return read_user_text(path, RunEnvError, _KIND, may_be_empty=True).split("\n")


def _setting_on(line: str, path: Path, number: int) -> tuple[str, str, str]:
    """Return the name on a line as it is written, its value without quotes, and the quote that it had."""
    match = _LINE.match(line)
    if match is None:
        raise RunEnvError(path, Message("{line!r}", line=line.strip()[:60]), _KIND, line=number)
    value, quote = _unquoted(match[2])
    if quote == _BROKEN:
        found = Message("{value!r} opens a quote", value=value[:60])
        name = OTHER_SPELLINGS.get(match[1], match[1])
        raise RunEnvError(path, found, "it closed on the same line", line=number, key=name)
    return match[1], value, quote


def _known_name(written: str, where: str, notes: list[str]) -> str:
    name = OTHER_SPELLINGS.get(written, written)
    if name != written:
        notes.append(f"{where}: {written} is read as {name}")
    elif name not in BY_NAME:
        hint = nearest(name, BY_NAME)
        near = f". {hint}" if hint.startswith("Did you mean") else ""
        notes.append(f"{where}: unknown variable {name} is kept and does nothing{near}")
    return name


def _unquoted(text: str) -> tuple[str, str]:
    """Return a value without quotes and without a remark behind it, and the quote that it had."""
    closing = _QUOTES.get(text[:1], "")
    ends = [place for place, mark in enumerate(text) if place > 0 and mark in closing]
    if closing and ends:
        return text[1 : ends[0]], text[0]
    if text[:1] in _OPENING:
        return text, _BROKEN
    return re.sub(r"(^|\s+)#.*$", "", text), ""


def _filled_in(text: str, values: Mapping[str, str], where: str, notes: list[str]) -> str:
    def fill(match: re.Match[str]) -> str:
        name = match[1] or match[2]
        name = OTHER_SPELLINGS.get(name, name)
        if name not in values:
            notes.append(f"{where}: ${name} is not set above; nothing is put in its place")
        return values.get(name, "")

    return _VARIABLE.sub(fill, text)


def _quoted_if_needed(value: str) -> str:
    return f'"{value}"' if re.search(r"[\s#]", value) else value
