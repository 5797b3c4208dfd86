"""What a person's file may be instead of the file that was meant, and what the error says to do."""

import os
import threading

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.formats.user_file import read_user_file, read_user_text, typing_hint

HTML = b'\n<!DOCTYPE html>\n<html lang="en"><head><title>reward.py</title></head></html>'
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n"


def error_of(path, read=read_user_text):
    with pytest.raises(InputFileError) as caught:
        read(path, InputFileError, "a table")
    return str(caught.value)


@pytest.mark.parametrize(
    ("data", "found", "hint"),
    [
        (b"", "the file is empty", "Download it again"),
        (b" \n", "the file is empty", "Download it again"),
        (HTML, "a web page (HTML)", "download the file itself"),
        (LFS, "a pointer of Git LFS", "`git lfs pull`"),
        ("Größe = 1\n".encode("latin-1"), ":1: byte 0xf6 (byte 2 of the file) is not UTF-8", "Save it as UTF-8."),
        ("speed = 1\n".encode("utf-16-le"), "text in UTF-16", "Save it as UTF-8."),
    ],
)
def test_a_file_that_is_something_else_is_named_as_that(tmp_path, data, found, hint):
    path = tmp_path / "file.txt"
    path.write_bytes(data)
    text = error_of(path)
    assert found in text
    assert hint in text


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_texts_with_a_byte_order_mark_are_read(tmp_path, encoding):
    path = tmp_path / "file.txt"
    path.write_bytes("Größe = 1\r\nb\r".encode(encoding))
    assert read_user_text(path, InputFileError, "a table") == "Größe = 1\nb\n"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_is_refused_at_once_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    told = []
    reading = threading.Thread(target=lambda: told.append(error_of(tmp_path / "pipe")), daemon=True)
    reading.start()
    reading.join(60)
    assert told
    assert "a named pipe; expected a regular file" in told[0]


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero here")
def test_a_device_without_end_is_refused():
    assert "a device; expected a regular file" in error_of("/dev/zero")


def test_a_file_above_the_limit_is_not_read_whole(tmp_path):
    (tmp_path / "large").write_bytes(b"a" * (2**20 + 1))
    text = error_of(tmp_path / "large", lambda *words: read_user_file(*words, max_bytes=2**20))
    assert "more than 1 MiB" in text


@pytest.mark.parametrize(
    ("typed", "hint"),
    [
        ("params[“speed”]", 'Type " instead of “.'),
        ("it’s", "Type ' instead of ’."),
        ("speed – 1", "Type - instead of –."),
        ("f（x）", "Type ( instead of （."),
        ("x\u00a0= 1", "Type an ordinary space instead of U+00A0."),
        ("größe = 1", ""),
    ],
)
def test_what_looks_like_a_key_is_told_which(typed, hint):
    assert typing_hint(typed) == hint
