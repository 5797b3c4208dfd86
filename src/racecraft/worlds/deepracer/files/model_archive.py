"""Archives of models, unpacked as what they are: a stranger's. Begin with `unpack_model`.

DeepRacer for Cloud, AWS's consoles and physical cars give `.tar.gz`; one console gave a ZIP under that name. The
archive is read once from front to back, in pieces of a megabyte; only files that belong to a model are written, below
one folder. Everything else of it is looked at by its header only: a name that leads out of the archive, a link, a
device, more bytes than such archives have, or far more than their packed size suggests ends it with a letter.
"""

from __future__ import annotations

import gzip
import io
import re
import shutil
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import IO

from racecraft.contract.errors import InputFileError
from racecraft.formats.whole import make_folder, whole_file

KIND = "an archive of a DeepRacer model (.tar.gz or .zip): a car's, a console's or DeepRacer for Cloud's"
PIECE = 2**20
MOST_MEMBERS = 100_000
MOST_BYTES = 16 * 2**30
"""Unpacked, all members together; consoles take archives of a gigabyte."""
MOST_RATIO = 100
"""Unpacked bytes for each packed one; texts of numbers come to ten. Looked at from `FREE_BYTES` on."""
FREE_BYTES = 256 * 2**20
MOST_HEADER = 8 * 2**20
"""What one read of a header may ask for."""
MB = 2**20
WANTED: tuple[tuple[str, int], ...] = (
    (r"model_metadata\.json|hyperparameters\.json|deepracer_checkpoints\.json", MB),
    (r"reward_function\.py|\.?coach_checkpoint|checkpoint", MB),
    (r"training_params\.ya?ml", 10 * MB),
    (r"model(_\d+)?\.pb", 2048 * MB),
    (r".+\.ckpt\.index", 64 * MB),
    (r".+\.ckpt\.meta", 512 * MB),
    (r".+\.ckpt\.data-\d{5}-of-\d{5}", 4096 * MB),
)
"""Names of a model's files, and the most bytes each may have."""


class ArchiveError(InputFileError):
    """An archive cannot be used: no archive, damaged, or dangerous."""


def is_archive(path: str | Path) -> bool:
    """Tell by its first bytes whether a file is an archive of a kind that we unpack."""
    return Path(path).is_file() and _kind_of(Path(path)) in ("gzip", "zip", "tar")


def unpack_model(path: str | Path, into: str | Path) -> list[Path]:
    """Unpack what belongs to a model, and return the files that were written.

    Args:
        path: The archive.
        into: An empty folder.

    Raises:
        ArchiveError: It is no archive, damaged, dangerous, or holds nothing of a model.
        OutputFileError: There is no room for it.
    """
    path, into = Path(path), Path(into)
    unpackers: dict[str, Callable[[Path, Path], list[Path]]] = {"gzip": _untar, "tar": _untar, "zip": _unzip}
    kind = _kind_of(path)
    if kind not in unpackers:
        raise ArchiveError(path, kind, KIND)
    try:
        written = unpackers[kind](path, into)
    except (tarfile.TarError, zipfile.BadZipFile, zlib.error, EOFError, gzip.BadGzipFile, struct.error) as error:
        raise ArchiveError(path, f"damaged ({error})", KIND, "Copy or download it again.") from error
    except (NotImplementedError, RuntimeError) as error:  # zipfile's words for a password or an unknown packing
        raise ArchiveError(path, f"cannot be unpacked ({error})", KIND) from error
    if not written:
        raise ArchiveError(path, "it holds no file of a model", "model_metadata.json with weights (.pb or .ckpt)")
    return written


def _kind_of(path: Path) -> str:
    """Return "gzip", "zip" or "tar", or in words what else it is."""
    try:
        with open(path, "rb") as file:
            head = file.read(512)
    except FileNotFoundError:
        raise ArchiveError(path, "there is no such file", KIND) from None
    except OSError as error:
        raise ArchiveError(path, f"cannot be read ({error.strerror})", KIND) from error
    if head[:2] == b"\x1f\x8b":
        return "gzip"
    if head[:4] == b"PK\x03\x04":
        return "zip"
    if head[257:262] == b"ustar":
        return "tar"
    others = {b"BZh": "packed by bzip2", b"\xfd7zXZ": "packed by xz", b"7z\xbc\xaf": "a 7z archive", b"Rar!": "a RAR"}
    return next((words for magic, words in others.items() if head.startswith(magic)), "no archive" if head else "empty")


class _Guard(io.RawIOBase):
    """The unpacked stream, read forwards only, whose sizes are watched."""

    def __init__(self, stream: gzip.GzipFile | io.BufferedReader, path: Path) -> None:
        self._stream, self._path, self._at = stream, path, 0
        self._packed = path.stat().st_size

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes."""
        if not 0 <= size <= MOST_HEADER:
            raise ArchiveError(self._path, f"a header in it asks for {size} bytes", KIND)
        data = self._stream.read(size)
        self._count(len(data))
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move forwards, by reading over what lies between."""
        if whence != io.SEEK_SET or offset < self._at:
            raise tarfile.ReadError(f"its parts lead back to byte {offset}")
        while self._at < offset:
            data = self._stream.read(min(PIECE, offset - self._at))
            if not data:
                raise tarfile.ReadError("it ends too early")
            self._count(len(data))
        return self._at

    def tell(self) -> int:
        """Return how much was read."""
        return self._at

    def seekable(self) -> bool:
        """Forwards."""
        return True

    def readable(self) -> bool:
        """Always."""
        return True

    def _count(self, more: int) -> None:
        self._at += more
        require_sane_size(self._path, self._at, self._packed)


def require_sane_size(path: Path, unpacked: int, packed: int) -> None:
    """Refuse what grows beyond every model.

    Raises:
        ArchiveError: It does.
    """
    if unpacked > MOST_BYTES:
        raise ArchiveError(path, f"it unpacks to more than {MOST_BYTES >> 30} GiB", KIND)
    if unpacked > FREE_BYTES and unpacked > MOST_RATIO * packed:
        found = f"its {packed} bytes unpack to more than {MOST_RATIO} times as many"
        raise ArchiveError(path, found, KIND, "It was made to fill a disk.")


def _untar(path: Path, into: Path) -> list[Path]:
    written: list[Path] = []
    with open(path, "rb") as raw:
        guard = _Guard(gzip.GzipFile(fileobj=raw) if _kind_of(path) == "gzip" else raw, path)
        with tarfile.open(fileobj=guard, mode="r:") as tar:
            for count, member in enumerate(tar):
                if count >= MOST_MEMBERS:
                    raise ArchiveError(path, f"it holds more than {MOST_MEMBERS} members", KIND)
                tar.members.clear()  # type: ignore[attr-defined]  # a list of them would grow with the archive
                if member.isdir():
                    continue
                place = _safe_name(path, member.name)
                if not member.isreg() or member.issparse():
                    raise ArchiveError(path, f"'{member.name}' is {_kind_of_member(member)}", "plain files only")
                limit = _limit_for(place)
                if limit is None:
                    continue
                _require_size(path, member.name, member.size, limit)
                source = tar.extractfile(member)
                assert source is not None
                written.append(_write(source, into / place, path, member.size))
        while guard.read(PIECE):  # gzip's checksum stands at its very end
            pass
    return written


def _unzip(path: Path, into: Path) -> list[Path]:
    written: list[Path] = []
    packed, total = path.stat().st_size, 0
    with zipfile.ZipFile(path) as archive:
        if len(archive.infolist()) > MOST_MEMBERS:
            raise ArchiveError(path, f"it holds more than {MOST_MEMBERS} members", KIND)
        for member in archive.infolist():
            total += member.file_size
            require_sane_size(path, total, packed)
            if member.is_dir():
                continue
            place = _safe_name(path, member.filename)
            mode = member.external_attr >> 16
            if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
                raise ArchiveError(path, f"'{member.filename}' is a link or a device", "plain files only")
            limit = _limit_for(place)
            if limit is None:
                continue
            _require_size(path, member.filename, member.file_size, limit)
            with archive.open(member) as source:
                written.append(_write(source, into / place, path, member.file_size))
    return written


def _safe_name(path: Path, name: str) -> PurePosixPath:
    """Return a member's place below the folder it is unpacked into.

    Raises:
        ArchiveError: It lies elsewhere.
    """
    place = PurePosixPath(name.replace("\\", "/"))
    if place.is_absolute() or ".." in place.parts or re.match(r"[A-Za-z]:", name) or "\0" in name:
        raise ArchiveError(path, f"'{name}' leads out of the archive", "names inside it", "It was made to do harm.")
    return place


def _limit_for(place: PurePosixPath) -> int | None:
    """Return the most bytes a model's file of this name may have; None: it is none."""
    if place.name.startswith("._"):
        return None  # what macOS keeps beside a file
    return next((limit for pattern, limit in WANTED if re.fullmatch(pattern, place.name)), None)


def _require_size(path: Path, name: str, size: int, limit: int) -> None:
    if size > limit:
        raise ArchiveError(path, f"'{name}' has {size} bytes", f"{limit} at most for such a file")


def _kind_of_member(member: tarfile.TarInfo) -> str:
    if member.issym() or member.islnk():
        return f"a link to '{member.linkname}'"
    return "a sparse file" if member.issparse() else "a device or a pipe"


def _write(source: IO[bytes], target: Path, path: Path, size: int) -> Path:
    if target.exists():
        raise ArchiveError(path, f"'{target.name}' stands in it twice at the same place", "each file once")
    make_folder(target.parent)
    with whole_file(target) as part, open(part, "wb") as file:
        shutil.copyfileobj(source, file, PIECE)
        if file.tell() != size:
            raise ArchiveError(path, f"'{target.name}' ends after {file.tell()} of {size} bytes", KIND)
    return target
