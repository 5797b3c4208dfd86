"""Archives of models: what belongs to a model comes out, and what was made to do harm is refused by name."""

import gzip
import io
import sys
import tarfile
import zipfile

import pytest

from racecraft.formats.archive import ArchiveError, is_archive
from racecraft.worlds.deepracer.files.car_archive import GRAPH, METADATA, archive_folder, write_car_archive
from racecraft.worlds.deepracer.files.model_archive import unpack_model

GOOD = {"model_metadata.json": b"{}", "agent/model.pb": b"weights"}


def tar(path, entries, mode="w:gz"):
    """Write an archive of (name or TarInfo, bytes) pairs."""
    with tarfile.open(path, mode) as archive:
        for name, data in entries:
            entry = name if isinstance(name, tarfile.TarInfo) else tarfile.TarInfo(name)
            entry.size = len(data) if entry.isreg() else 0
            archive.addfile(entry, io.BytesIO(data))
    return path


def special(name, kind, target=""):
    entry = tarfile.TarInfo(name)
    entry.type, entry.linkname = kind, target
    return entry


def packed(path, names, mode=None):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in names:
            entry = zipfile.ZipInfo(name)
            entry.external_attr, entry.compress_type = (mode or 0) << 16, zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return path


@pytest.mark.parametrize("mode", ["w:gz", "w:bz2", "w"])
def test_what_belongs_to_a_model_comes_out_and_nothing_else(tmp_path, mode):
    others = [("training-simtrace/0-iteration.csv", b"1"), ("._model.pb", b"mac"), ("bin/run.sh", b"echo")]
    archive = tar(tmp_path / "a.tar.gz", [*GOOD.items(), *others, (special("agent", tarfile.DIRTYPE), b"")], mode)
    unpacked = unpack_model(archive, tmp_path / "out")
    assert sorted(path.relative_to(tmp_path / "out").as_posix() for path in unpacked) == sorted(GOOD)
    assert (tmp_path / "out/agent/model.pb").read_bytes() == b"weights"
    assert len([path for path in (tmp_path / "out").rglob("*") if path.is_file()]) == 2


def test_a_zip_called_tar_gz_is_a_zip(tmp_path):
    archive = packed(tmp_path / "virtualmodel-mine.tar.gz", GOOD.items())
    assert is_archive(archive)
    assert len(unpack_model(archive, tmp_path / "out")) == 2


def test_what_a_car_takes_comes_back(tmp_path):
    path = write_car_archive(tmp_path / "export", b"graph", "{}")
    assert path.name == "carfile.tar.gz"
    with tarfile.open(path) as archive:
        assert archive.getnames() == [GRAPH, METADATA]
    again = write_car_archive(tmp_path / "again.tar.gz", b"graph", "{}")
    assert again.read_bytes() == path.read_bytes()


BAD = {
    "no file": (lambda path: path, "there is no such file"),
    "empty": (lambda path: path.write_bytes(b""), "empty"),
    "a text": (lambda path: path.write_bytes(b"hello, I am a model"), "not an archive"),
    "xz": (lambda path: tar(path, GOOD.items(), "w:xz"), "packed by xz"),
    "7z": (lambda path: path.write_bytes(b"7z\xbc\xaf\x27\x1c"), "a 7z archive"),
    "gzip of no tar": (lambda path: path.write_bytes(gzip.compress(b"x" * 2000)), "damaged"),
    "cut short": (lambda path: path.write_bytes(tar(path, [("model.pb", bytes(range(256)) * 400)]).read_bytes()[:400]),
                  "damaged"),
    "gzip with a wrong checksum": (
        lambda path: path.write_bytes(tar(path, GOOD.items()).read_bytes()[:-8] + b"\0" * 8), "damaged"
    ),
    "a way out": (lambda path: tar(path, [("../../model.pb", b"x")]), "leads out of the archive"),
    "a way out in Windows's way": (lambda path: tar(path, [("..\\model.pb", b"x")]), "leads out"),
    "from the root": (lambda path: tar(path, [("/etc/model.pb", b"x")]), "leads out"),
    "from a drive": (lambda path: tar(path, [("C:/model.pb", b"x")]), "leads out"),
    "a link": (lambda path: tar(path, [(special("model.pb", tarfile.SYMTYPE, "/etc/passwd"), b"")]), "a link to"),
    "a link to a neighbour": (
        lambda path: tar(path, [*GOOD.items(), (special("model.pb", tarfile.LNKTYPE, "agent/model.pb"), b"")]),
        "a link to 'agent/model.pb'",
    ),
    "a link among what is not wanted": (
        lambda path: tar(path, [(special("logs", tarfile.SYMTYPE, "/"), b""), *GOOD.items()]), "a link to '/'"
    ),
    "a device": (lambda path: tar(path, [(special("model.pb", tarfile.CHRTYPE), b"")]), "a device or a pipe"),
    "a pipe": (lambda path: tar(path, [(special("model.pb", tarfile.FIFOTYPE), b"")]), "a device or a pipe"),
    "one file twice": (lambda path: tar(path, [("model.pb", b"x"), ("model.pb", b"y")]), "twice"),
    "nothing of a model": (lambda path: tar(path, [("holiday.jpg", b"x")]), "no file of a model"),
    "a metadata file of megabytes": (
        lambda path: tar(path, [("model_metadata.json", b" " * (2**20 + 1))]), "1048576 at most"
    ),
    "zip: a way out": (lambda path: packed(path, [("../model.pb", b"x")]), "leads out"),
    "zip: a link": (lambda path: packed(path, [("model.pb", b"/etc/passwd")], 0o120777), "a link or a device"),
    "zip: cut short": (
        lambda path: path.write_bytes(packed(path, [("model.pb", bytes(5000))]).read_bytes()[:60]), "damaged"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_archive_is_refused_by_a_letter_and_leaves_nothing_behind(tmp_path, case):
    make, words = BAD[case]
    path = tmp_path / "model.tar.gz"
    make(path)
    (tmp_path / "deep").mkdir()
    with pytest.raises(ArchiveError) as caught:
        unpack_model(path, tmp_path / "deep" / "out")
    assert words in str(caught.value)
    assert "expected" in str(caught.value)
    outside = [one for one in tmp_path.rglob("*") if one.is_file() and tmp_path / "deep" not in one.parents]
    assert outside in ([path], [])


def test_a_header_that_asks_for_gigabytes_is_refused(tmp_path):
    """The extended header of a member says how long it is itself; tarfile reads it whole."""
    entry = tarfile.TarInfo("././@PaxHeader")
    entry.type, entry.size = tarfile.XHDTYPE, 3 * 2**30
    path = tmp_path / "model.tar.gz"
    path.write_bytes(gzip.compress(entry.tobuf(tarfile.USTAR_FORMAT) + bytes(4096)))
    with pytest.raises(
        ArchiveError, match="asks for 3221225472 bytes" if sys.version_info < (3, 14) else "empty header"
    ):
        unpack_model(path, tmp_path / "out")


MIB = 2**20
LIMITS = {"model_metadata.json": 1, "model_12.pb": 2048, "3_Step-9.ckpt.data-00000-of-00001": 4096}
"""MiB; a console's checkpoint of the largest network has some 500."""


@pytest.mark.parametrize("name", LIMITS)
def test_a_file_says_in_its_header_how_large_it_is_and_may_be_so_large(tmp_path, name):
    """Nothing stands behind the header: what is too large is refused before, what is not ends too early."""
    for beyond, words in (
        (0, "damaged"),
        (1, f"has {LIMITS[name] * MIB + 1} bytes; expected {LIMITS[name] * MIB} at most"),
    ):
        entry = tarfile.TarInfo(f"model/{name}")
        entry.size = LIMITS[name] * MIB + beyond
        path = tmp_path / "model.tar"
        path.write_bytes(entry.tobuf(tarfile.USTAR_FORMAT) + bytes(1024))
        with pytest.raises(ArchiveError, match=words):
            unpack_model(path, tmp_path / f"out {beyond}")


@pytest.mark.parametrize("name", ["my.pb", "3.ckpt.data-0-of-1"])
def test_names_that_are_only_near_a_models_are_passed_over(tmp_path, name):
    unpacked = unpack_model(tar(tmp_path / "a.tar", [(name, b"x"), ("model.pb", b"y")], "w"), tmp_path / "out")
    assert [path.name for path in unpacked] == ["model.pb"]


def test_what_is_inside_folders_of_a_zip_comes_out_in_them(tmp_path):
    path = packed(tmp_path / "a.zip", [("m/", b""), ("m/agent/model.pb", b"w"), ("m/x.csv", b"1")], 0o100644)
    assert unpack_model(path, tmp_path / "out") == [tmp_path / "out" / "m" / "agent" / "model.pb"]
    assert (tmp_path / "out" / "m" / "agent" / "model.pb").read_bytes() == b"w"
    assert sorted(one.name for one in (tmp_path / "out").rglob("*")) == ["agent", "m", "model.pb"]


def test_a_zip_whose_files_are_too_large_or_that_is_locked_is_refused(tmp_path):
    large = packed(tmp_path / "a.zip", [("reward_function.py", bytes(MIB + 1))])
    with pytest.raises(ArchiveError, match=r"'reward_function.py' has 1048577 bytes; expected 1048576 at most"):
        unpack_model(large, tmp_path / "out")
    data = bytearray(packed(tmp_path / "b.zip", [("model.pb", b"x")]).read_bytes())
    data[6] |= 1  # the bit that says a password is needed: in the file's own header and in the list at the end
    data[data.index(b"PK\1\2") + 8] |= 1
    (tmp_path / "b.zip").write_bytes(data)
    with pytest.raises(ArchiveError, match="cannot be unpacked .*password"):
        unpack_model(tmp_path / "b.zip", tmp_path / "out")


def test_a_folders_files_are_packed_by_their_names_within_it(tmp_path):
    (tmp_path / "m" / "b").mkdir(parents=True)
    (tmp_path / "m" / "b" / "model.pb").write_bytes(b"graph")
    (tmp_path / "m" / "a.json").write_bytes(b"{}")
    archive_folder(tmp_path / "m.tar.gz", tmp_path / "m")
    with tarfile.open(tmp_path / "m.tar.gz") as archive:
        assert archive.getnames() == ["a.json", "b/model.pb"]
        assert archive.extractfile("b/model.pb").read() == b"graph"


def test_what_a_car_takes_has_no_times_and_may_be_read_by_all(tmp_path):
    path = write_car_archive(tmp_path / "new" / "mine.tgz", b"graph", "{}")
    assert path == tmp_path / "new" / "mine.tgz"
    assert path.read_bytes()[4:8] == bytes(4), "gzip's own time"
    with tarfile.open(path) as archive:
        assert [(one.mode, one.mtime, one.size) for one in archive] == [(0o644, 0, 5), (0o644, 0, 2)]
        assert archive.extractfile(GRAPH).read() == b"graph"
