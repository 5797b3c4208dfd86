"""What a notebook's start-up script would lay into its folder, read line by line; nothing is run.

Begin with `read_start_script`. Understood are the commands by which such scripts bring files: cd, curl, wget,
`aws s3 cp|sync`, git clone, unzip, touch, and echo into a file. Every other line is told as left.
"""

from __future__ import annotations

import posixpath
import re
import shlex
from dataclasses import dataclass, field

HOME = re.compile(r"^(?:/home/ec2-user/SageMaker|~/SageMaker|\$HOME/SageMaker|SageMaker)(?:/|$)")
"""What such scripts call the notebook's folder."""
JOINTS = ";&|"
"""Join commands; a line that has one is left."""
_HEREDOC = re.compile(r"<<-?\s*['\"]?(\w+)['\"]?\s*$")


@dataclass(frozen=True)
class Fetched:
    """A file or a folder that is brought from elsewhere."""

    path: str
    """In the notebook's folder; of a folder that is laid out flat, "."."""
    source: str
    is_folder: bool = False


@dataclass(frozen=True)
class Unpacked:
    """An archive that is unpacked."""

    path: str
    into: str


@dataclass(frozen=True)
class Written:
    """A line that goes to a file."""

    path: str
    text: str
    appends: bool


@dataclass
class StartScript:
    """What is laid, in its order, and what is left."""

    acts: list[Fetched | Unpacked | Written] = field(default_factory=list)
    left: list[str] = field(default_factory=list)


def read_start_script(text: str) -> StartScript:
    r"""Read a script.

    >>> read_start_script("cd SageMaker\ncurl -O https://there/a.zip\nunzip a.zip -d b\npip install x").left
    ['pip install x']
    """
    return _Reader().read(text)


class _Reader:
    def __init__(self) -> None:
        self.found = StartScript()
        self.here = ""

    def read(self, text: str) -> StartScript:
        ends: list[str] = []
        for line in map(str.strip, text.replace("\\\n", " ").splitlines()):
            if ends and line == ends[-1]:
                ends.pop()
                continue
            opened = _HEREDOC.search(line)
            if opened:
                ends.append(opened[1])
            if line and not line.startswith("#") and not self._understood(line):
                self.found.left.append(line)
        return self.found

    def _understood(self, line: str) -> bool:
        try:
            words = _words(line)
        except ValueError:
            return False
        if words[:1] == ["sudo"]:
            words = words[1:]
        if not words or any(word and set(word) <= set(JOINTS) for word in words):
            return not words
        name, rest = words[0], words[1:]
        act = {
            "cd": self._cd, "curl": self._curl, "wget": self._wget, "aws": self._aws,
            "git": self._git, "unzip": self._unzip, "touch": self._touch, "echo": self._echo,
        }.get(name)  # fmt: skip
        return act(rest) if act is not None else False

    def _place(self, path: str) -> str | None:
        """Return a path in the notebook's folder; None: outside of it, or not to be known."""
        in_home = HOME.match(path)
        if in_home:
            path = path[in_home.end() :]
        elif path.startswith(("/", "~")):
            return None
        else:
            path = posixpath.join(self.here, path)
        path = posixpath.normpath(path)
        return None if path.startswith("..") or any(mark in path for mark in "$`*?\\\0") else path

    def _cd(self, rest: list[str]) -> bool:
        place = self._place(rest[0]) if len(rest) == 1 else None
        if place is not None:
            self.here = place
        return place is not None

    def _fetch(self, path: str, source: str, is_folder: bool = False) -> bool:
        place = self._place(path) if path else None
        if place is None or "$" in source:
            return False
        self.found.acts.append(Fetched(place, source, is_folder))
        return True

    def _curl(self, rest: list[str]) -> bool:
        return self._download(rest, ("-o", "--output"), takes_name=any("O" in one for one in _short(rest)))

    def _wget(self, rest: list[str]) -> bool:
        return self._download(rest, ("-O", "--output-document"), takes_name=True)

    def _download(self, rest: list[str], output: tuple[str, str], takes_name: bool) -> bool:
        addresses = [word for word in rest if "://" in word]
        named = [after for word, after in zip(rest, rest[1:], strict=False) if word in output]
        if len(addresses) != 1 or len(named) > 1 or not (named or takes_name or "--remote-name" in rest):
            return False
        return self._fetch(named[0] if named else _last(addresses[0]), addresses[0])

    def _aws(self, rest: list[str]) -> bool:
        words = [word for word in rest if not word.startswith("-")]
        if len(words) < 4 or words[0] != "s3" or words[1] not in ("cp", "sync"):
            return False
        source, target = words[2], words[3]
        if not source.startswith("s3://"):
            return False
        is_folder = words[1] == "sync" or "--recursive" in rest
        if not is_folder and (target == "." or target.endswith("/")):
            target = posixpath.join(target, _last(source))
        return self._fetch(target, source, is_folder)

    def _git(self, rest: list[str]) -> bool:
        place = next((place for place, word in enumerate(rest) if "://" in word or "@" in word), None)
        if rest[:1] != ["clone"] or place is None:
            return False
        address, behind = rest[place], [word for word in rest[place + 1 :] if not word.startswith("-")]
        if len(behind) > 1:
            return False
        return self._fetch(behind[0] if behind else _last(address).removesuffix(".git"), address, is_folder=True)

    def _unzip(self, rest: list[str]) -> bool:
        into = [after for word, after in zip(rest, rest[1:], strict=False) if word == "-d"]
        archives = [word for word in rest if not word.startswith("-") and word not in into]
        archive = self._place(archives[0]) if len(archives) == 1 else None
        place = self._place(into[0] if into else ".")
        if archive is None or place is None:
            return False
        self.found.acts.append(Unpacked(archive, place))
        return True

    def _touch(self, rest: list[str]) -> bool:
        places = [self._place(path) for path in rest]
        if not places or None in places:
            return False
        self.found.acts += [Written(place, "", True) for place in places if place]
        return True

    def _echo(self, rest: list[str]) -> bool:
        if len(rest) < 2 or rest[-2] not in (">", ">>"):
            return False
        place, text = self._place(rest[-1]), " ".join(rest[:-2])
        if place is None or text.startswith("-"):
            return False
        self.found.acts.append(Written(place, f"{text}\n", rest[-2] == ">>"))
        return True


def _words(line: str) -> list[str]:
    """Return a line's words; what joins commands is a word of its own."""
    reader = shlex.shlex(line, posix=True, punctuation_chars=JOINTS)
    reader.whitespace_split = True
    return list(reader)


def _short(words: list[str]) -> list[str]:
    """Return options of one dash."""
    return [word for word in words if word.startswith("-") and not word.startswith("--")]


def _last(address: str) -> str:
    """Return the last part of an address."""
    return address.split("?")[0].rstrip("/").split("/")[-1]
