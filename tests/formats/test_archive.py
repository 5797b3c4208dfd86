"""Archives of unknown origin: bounded before they are unpacked, and nothing but plain files inside."""

import contextlib
import io
import tarfile
import zipfile

import numpy as np
import pytest

from racecraft.formats.archive import ArchiveError, Limits, is_archive, members, unpack

MIB = 2**20


def packed(path, files, mode="w:gz"):
    """Write a tar, or with mode "zip" a zip."""
    if mode == "zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files:
                archive.writestr(name, data)
    else:
        with tarfile.open(path, mode) as archive:
            for name, data in files:
                entry = tarfile.TarInfo(name)
                entry.size = len(data)
                archive.addfile(entry, io.BytesIO(data))
    return path


@pytest.mark.parametrize("mode", ["w:gz", "w:bz2", "w", "zip"])
def test_files_come_out_in_their_folders(tmp_path, mode):
    path = packed(tmp_path / "archive", [("a/b.txt", b"b"), ("./c.txt", b"c")], mode)
    assert is_archive(path)
    assert unpack(path, tmp_path / "out", "an archive") == [tmp_path / "out/a/b.txt", tmp_path / "out/c.txt"]
    assert (tmp_path / "out/a/b.txt").read_bytes() == b"b"
    assert [(str(one.path), one.size, one.read()) for one in members(path.read_bytes(), "an archive")] == [
        ("a/b.txt", 1, b"b"), ("c.txt", 1, b"c"),
    ]  # fmt: skip


@pytest.mark.parametrize("mode", ["w:gz", "w:bz2", "w", "zip"])
def test_no_more_than_the_limits_is_unpacked(tmp_path, mode):
    path = packed(tmp_path / "archive", [("zeros.bin", bytes(8 * MIB)), ("last.txt", b"x")], mode)
    for limits, words in (
        (Limits(max_bytes=7 * MIB), "unpacks to more than 7 MiB"),
        (Limits(max_members=1), "more than 1 members"),
        *([(Limits(free_bytes=MIB), "more than 100 times as many")] if mode != "w" else []),
    ):
        with pytest.raises(ArchiveError, match=words):
            list(members(path, "an archive", limits))
    assert len(list(members(path, "an archive", Limits(max_bytes=9 * MIB, max_members=2)))) == 2


def test_a_zip_of_279_kb_that_unpacks_to_270_mib_is_refused_before_it_is_read(monkeypatch):
    packed_arrays = io.BytesIO()
    np.savez_compressed(packed_arrays, pixels=np.zeros(270 * MIB, np.uint8))
    body = packed_arrays.getvalue()
    assert len(body) < 280_000

    def opened(*_, **__):
        raise AssertionError("it was unpacked")

    monkeypatch.setattr(zipfile.ZipFile, "open", opened)
    with pytest.raises(ArchiveError, match="more than 100 times as many"):
        list(members(body, "what numpy.savez writes"))


@pytest.mark.parametrize(
    ("unpacked", "packed", "refused"),
    [(256 * MIB, 1, False), (256 * MIB + 1, 1, True), (300 * MIB, 3 * MIB, False), (300 * MIB + 1, 3 * MIB, True),
     (16 * 1024 * MIB, 1024 * MIB, False), (16 * 1024 * MIB + 1, 1024 * MIB, True)],
)  # fmt: skip
def test_from_256_mib_on_an_archive_may_shrink_a_hundredfold_and_have_16_gib(unpacked, packed, refused):
    with pytest.raises(ArchiveError) if refused else contextlib.nullcontext():
        Limits().check("model.tar.gz", unpacked, packed, "an archive")


@pytest.mark.parametrize("mode", ["w", "zip"])
@pytest.mark.parametrize("name", ["../a.txt", "/etc/a.txt", "C:/a.txt", "..\\a.txt", "a/../../a.txt"])
def test_a_name_that_leads_out_is_refused(tmp_path, mode, name):
    path = packed(tmp_path / "archive", [("good.txt", b""), (name, b"")], mode)
    with pytest.raises(ArchiveError, match="leads out of the archive"):
        unpack(path, tmp_path / "deep" / "out", "an archive")
    assert not list(tmp_path.rglob("a.txt"))


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE])
def test_links_and_devices_are_refused(tmp_path, kind):
    entry = tarfile.TarInfo("a")
    entry.type, entry.linkname = kind, "b"
    with tarfile.open(tmp_path / "a.tar", "w") as archive:
        archive.addfile(entry)
    with pytest.raises(ArchiveError, match="plain files only"):
        list(members(tmp_path / "a.tar", "an archive"))
    link = zipfile.ZipInfo("a")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(ArchiveError, match="plain files only"):
        list(members(tmp_path / "a.zip", "an archive"))


def test_damage_met_while_a_file_is_read_is_an_archive_error(tmp_path):
    noise = np.random.default_rng(1).bytes(4 * MIB)
    for mode in ("w:gz", "zip"):
        data = bytearray(packed(tmp_path / "a", [("a.bin", noise)], mode).read_bytes())
        data[2 * MIB : 2 * MIB + 1000] = bytes(1000)
        with pytest.raises(ArchiveError, match="damaged"):
            [member.read() for member in members(bytes(data), "an archive")]
        (tmp_path / "b").write_bytes(data)
        with pytest.raises(ArchiveError, match="damaged"):
            unpack(tmp_path / "b", tmp_path / mode, "an archive")
    assert not (tmp_path / "zip" / "a.bin").exists()  # gzip states its checksum at its end only


def test_an_archive_is_known_by_its_first_bytes(tmp_path):
    packed(tmp_path / "model.txt", [("model.pb", b"x")], "zip")
    packed(tmp_path / "model", [("model.pb", b"x")])
    (tmp_path / "model.tar.gz").write_text("not an archive")
    (tmp_path / "empty.zip").write_bytes(b"")
    assert [is_archive(tmp_path / name) for name in ("model.txt", "model")] == [True, True]
    assert [is_archive(tmp_path / name) for name in ("model.tar.gz", "empty.zip", "nowhere", ".")] == [False] * 4
