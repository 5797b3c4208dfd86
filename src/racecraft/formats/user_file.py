"""Files that a person names: read with a limit, and named as what they are where they are something else.

Begin with `read_user_file` and `read_user_text`.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import unicodedata
from pathlib import Path
from typing import TypeVar

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message

E = TypeVar("E", bound=InputFileError)

MAX_BYTES = 64 * 2**20
"""A file that a person writes is far smaller; what is larger is something else."""
SAVE_AS_UTF8 = "Save it as UTF-8."

_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_KINDS = {
    stat.S_ISFIFO: "a named pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
}
_HTML = re.compile(rb"\s*(<!--.*?-->\s*)*<(!doctype\s+html|html|head|body|script)\b", re.IGNORECASE | re.DOTALL)
HTML, LFS_POINTER = "a web page (HTML)", "a pointer of Git LFS"
_DOWNLOAD_HINTS = {
    HTML: "The page around the file was saved: download the file itself (on GitHub the button Raw).",
    LFS_POINTER: "The file itself is not there: `git lfs pull` fetches it.",
}
_LFS = b"version https://git-lfs.github.com/spec/"
_SINGLE_QUOTES, _DOUBLE_QUOTES = "\u2018\u2019\u201a\u201b\u2032\u00b4", "\u201c\u201d\u201e\u201f\u2033\u00ab\u00bb"
_KEYS = {
    **dict.fromkeys(_SINGLE_QUOTES, "'"),
    **dict.fromkeys(_DOUBLE_QUOTES, '"'),
    **dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212", "-"),
    "\u00d7": "*",
    "\u2026": "...",
}


def read_user_file(
    path: str | Path, error: type[InputFileError], kind: str, hint: str = "", max_bytes: int = MAX_BYTES
) -> bytes:
    """Return the bytes of a file that a person named.

    Args:
        path: The file.
        error: What to raise.
        kind: What the file should be, for the message: "a JSON object with hyperparameters".
        hint: What to do where it is missing or empty.
        max_bytes: The largest size that is read.

    Raises:
        InputFileError: Of the class `error`: no file, a folder, a pipe or a device, too large, empty, or a download
            that is something else.
    """
    path = Path(path)
    require_regular_file(path, error, kind, hint)
    try:
        with path.open("rb") as file:
            data = file.read(max_bytes + 1)
    except OSError as wrong:
        raise error(path, Message("the file cannot be read ({strerror})", strerror=wrong.strerror), kind) from wrong
    if len(data) > max_bytes:
        raise error(path, Message("more than {max_bytes} MiB", max_bytes=max_bytes // 2**20), kind)
    require_content(path, data, error, kind, hint)
    return data


def require_regular_file(path: Path, error: type[InputFileError], kind: str, hint: str = "") -> None:
    """Refuse what cannot be read to its end: a missing file, a folder, a pipe, a device.

    Raises:
        InputFileError: Of the class `error`.
    """
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise error(path, "there is no such file", kind, hint) from None
    except (OSError, ValueError) as wrong:  # ValueError: a NUL in the name
        raise error(
            path, Message("the file cannot be read ({problem})", problem=getattr(wrong, "strerror", wrong)), kind
        ) from wrong
    if stat.S_ISDIR(mode):
        raise error(path, "a folder", Message("a file with {kind}", kind=kind))
    for is_kind, name in _KINDS.items():
        if is_kind(mode):
            raise error(path, name, Message("a regular file with {kind}", kind=kind))


def regular(path: str | Path) -> Path:
    """Return a path that can be read to its end.

    Raises:
        OSError: There is no such file; or it is a pipe or a device, where reading would never end.
    """
    mode = os.stat(path).st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise OSError(errno.EINVAL, "a pipe or a device", str(path))
    return Path(path)


def read_regular(path: str | Path) -> bytes:
    """Return the bytes of a file; raise OSError as `regular` and `open` do."""
    return regular(path).read_bytes()


def require_content(path: Path, data: bytes, error: type[InputFileError], kind: str, hint: str = "") -> None:
    """Refuse an empty file, and a download that holds something else than the file.

    Args:
        path: The file.
        data: How the file begins; empty where the file is.
        error: What to raise.
        kind: What the file should be.
        hint: What to do where it is empty.

    Raises:
        InputFileError: Of the class `error`.
    """
    if not data:
        raise error(path, "the file is empty", kind, hint or "Was its download cut short? Download it again.")
    if found := other_content(data):
        raise error(path, found, kind, _DOWNLOAD_HINTS[found])


def other_content(data: bytes) -> str:
    """Return what a download holds instead of the file, by its first bytes; empty where nothing tells.

    >>> other_content(b"<!DOCTYPE html><html>"), other_content(b"PK")
    ('a web page (HTML)', '')
    """
    if _HTML.match(data[:4096]):
        return HTML
    return LFS_POINTER if data.startswith(_LFS) else ""


def read_user_text(path: str | Path, error: type[InputFileError], kind: str, may_be_empty: bool = False) -> str:
    r"""Return the text of a file that a person named, with "\n" at the end of each line.

    UTF-8 with or without a byte order mark, and UTF-16 with one.

    Args:
        path: The file.
        error: What to raise.
        kind: What the file should be.
        may_be_empty: Whether an empty file is one of that kind.

    Raises:
        InputFileError: Of the class `error`: as `read_user_file`, or the text is in another encoding.
    """
    path = Path(path)
    if may_be_empty and path.is_file() and path.stat().st_size == 0:
        return ""
    data = read_user_file(path, error, kind)
    if data.strip() or not may_be_empty:
        require_content(path, data.strip(), error, kind)
    try:
        text = data.decode("utf-16" if data.startswith(_UTF16_MARKS) else "utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise not_utf8(path, data, wrong.start, error) from None
    if looks_utf16(data):
        raise not_utf8(path, data, 0, error)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def not_utf8(path: str | Path, data: bytes, at: int, error: type[E]) -> E:
    """Return the error about a text in another encoding than UTF-8.

    Args:
        path: The file.
        data: Its bytes.
        at: Index of the first byte that is not UTF-8.
        error: The error's class.
    """
    line = data[:at].count(b"\n") + 1
    if looks_utf16(data) or data.startswith(_UTF16_MARKS):
        return error(path, "text in UTF-16", "a text file in UTF-8", SAVE_AS_UTF8)
    found = f"byte 0x{data[at]:02x} (byte {at} of the file) is not UTF-8"
    return error(path, found, "a text file in UTF-8", SAVE_AS_UTF8, line=line)


def looks_utf16(data: bytes) -> bool:
    """Tell whether bytes are UTF-16 without a byte order mark: in Latin letters every other byte is 0."""
    return data[:200].count(b"\0") > len(data[:200]) // 4 and not data.startswith(_UTF16_MARKS)


def typing_hint(text: str) -> str:
    """Return which key to type instead of the first character that looks like one of the keyboard's and is not.

    >>> typing_hint("params[\u2018speed\u2019]"), typing_hint("a\u00a0= 1"), typing_hint("speed = 1")
    ("Type ' instead of \u2018.", 'Type an ordinary space instead of U+00A0.', '')
    """
    for character in text:
        if character.isascii():
            continue
        key = _KEYS.get(character) or unicodedata.normalize("NFKC", character)
        if key == " ":
            return f"Type an ordinary space instead of U+{ord(character):04X}."
        if key.isascii() and not key.isalnum():
            return f"Type {key} instead of {character}."
    return ""
