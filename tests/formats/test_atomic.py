"""Files arrive whole or not at all."""

import errno
import os
import re
import stat
from pathlib import Path

import pytest

from racecraft.formats.atomic import (
    OutputFileError,
    append_atomic,
    atomic_file,
    make_folder,
    output_error,
    write_atomic,
)


def test_what_is_written_is_there_and_nothing_else_is(tmp_path):
    write_atomic(tmp_path / "a.txt", "ä\n")
    write_atomic(tmp_path / "b.bin", b"\x00\x01")
    assert (tmp_path / "a.txt").read_bytes() == b"\xc3\xa4\n"
    assert (tmp_path / "b.bin").read_bytes() == b"\x00\x01"
    assert sorted(os.listdir(tmp_path)) == ["a.txt", "b.bin"]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_a_disk_that_fails_leaves_the_old_file_and_gives_a_letter(tmp_path, monkeypatch, number):
    write_atomic(tmp_path / "a.txt", "old")

    def fail(handle):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OutputFileError, match=r"a\.txt: ") as letter:
        write_atomic(tmp_path / "a.txt", "new")
    assert ("disk is full" in str(letter.value)) == (number == errno.ENOSPC)
    assert (tmp_path / "a.txt").read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_writer_that_breaks_off_leaves_the_old_file(tmp_path):
    write_atomic(tmp_path / "a.txt", "old")

    def break_off():
        with atomic_file(tmp_path / "a.txt") as part:
            part.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        break_off()
    assert (tmp_path / "a.txt").read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_missing_folder_and_a_folder_in_the_way_give_letters(tmp_path):
    with pytest.raises(OutputFileError, match="its folder does not exist"):
        write_atomic(tmp_path / "no" / "a.txt", "x")
    (tmp_path / "b").mkdir()
    with pytest.raises(OutputFileError, match="cannot be written"):
        write_atomic(tmp_path / "b", "x")


def test_a_log_goes_on_behind_what_is_sound(tmp_path):
    path = tmp_path / "log"
    assert append_atomic(path, 0, b"one\n") == 4
    path.write_bytes(b"one\ntwo, torn by a cra")
    assert append_atomic(path, 4, b"two\n") == 8
    assert path.read_bytes() == b"one\ntwo\n"
    path.write_bytes(b"on")  # somebody cut it
    assert append_atomic(path, 8, b"three\n") == 8
    assert path.read_bytes() == b"onthree\n"
    with pytest.raises(OutputFileError, match="its folder does not exist"):
        append_atomic(tmp_path / "nowhere" / "log", 0, b"")


def test_a_folder_whose_place_is_taken_gets_a_letter(tmp_path):
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")
    (tmp_path / "file").touch()
    with pytest.raises(OutputFileError, match="file: cannot be written"):
        make_folder(tmp_path / "file")


def test_a_file_and_its_name_are_on_the_disk_before_anybody_goes_on(tmp_path, monkeypatch):
    """Once for what it holds, once for the folder in which its name stands."""
    kinds = []
    monkeypatch.setattr(os, "fsync", lambda handle: kinds.append(stat.S_ISDIR(os.fstat(handle).st_mode)))
    write_atomic(tmp_path / "a.txt", "x")
    assert kinds == [False, True]
    append_atomic(tmp_path / "log", 0, b"x")
    assert kinds == [False, True, False]


@pytest.mark.parametrize(
    ("error", "letter"),
    [
        (OSError(errno.EDQUOT, "over the quota"), "a: the disk is full"),
        (OSError("of no name"), r"a: cannot be written \(of no name\)"),
        (FileNotFoundError(errno.ENOENT, "gone"), "a: its folder does not exist; .* Create /b first"),
    ],
)
def test_a_letter_says_why(error, letter):
    assert re.match(f"/b/{letter}", output_error(Path("/b/a"), error))
