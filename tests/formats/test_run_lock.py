"""Locks: who holds one, what stands in its file meanwhile, and how it lies on Windows, by a stand-in of its calls."""

import datetime
import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from racecraft.contract.errors import RunFolderError, UserInputError
from racecraft.formats import run_lock
from racecraft.formats.run_lock import FileLock, RunLock, holder, holder_of


def lock(path):
    return FileLock(path, lambda who: UserInputError(f"taken by {who}"))


def test_a_held_lock_tells_by_whom_and_since_when_and_a_freed_one_is_empty(tmp_path):
    path = tmp_path / "a.lock"
    path.write_text("x" * 500)
    with lock(path) as held:
        told = json.loads(path.read_text())
        since = datetime.datetime.fromisoformat(told["since"])
        assert told["pid"] == os.getpid() == holder_of(path)
        assert abs((datetime.datetime.now(datetime.UTC) - since).total_seconds()) < 600
        assert since.microsecond == 0
        with pytest.raises(UserInputError, match=rf"taken by process {os.getpid()}, since 20"):
            lock(path)
        path.write_text("")
        with pytest.raises(UserInputError, match="taken by a process that has just begun"):
            lock(path)
        path.write_text("words")
    assert path.read_bytes() == b""
    assert holder_of(path) is None
    held.release()
    held.let_go()


def test_who_may_read_a_lock_is_left_to_everybody(tmp_path):
    before = os.umask(0)
    try:
        lock(tmp_path / "a.lock").release()
    finally:
        os.umask(before)
    assert (tmp_path / "a.lock").stat().st_mode & 0o777 == 0o644


def test_a_lock_that_is_let_go_is_free_and_its_words_stay(tmp_path):
    """As the child of a fork does it: the file is closed, nothing is written."""
    held = lock(tmp_path / "a.lock")
    held.let_go()
    held.release()
    assert json.loads((tmp_path / "a.lock").read_text())["pid"] == os.getpid()
    lock(tmp_path / "a.lock").release()


def test_no_file_stays_open_behind_a_lock_that_was_refused_or_freed(tmp_path):
    def opened():
        return sum(os.path.exists(f"/proc/self/fd/{number}") for number in range(256))

    if not os.path.exists("/proc/self/fd"):
        pytest.skip("Linux tells which files are open")
    before = opened()
    with lock(tmp_path / "a.lock"):
        assert opened() == before + 1
        with pytest.raises(UserInputError):
            lock(tmp_path / "a.lock")
        assert opened() == before + 1
    assert opened() == before


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"pid": "me"}'])
def test_a_file_that_names_nobody_is_held_by_nobody(tmp_path, text):
    (tmp_path / "run.lock").write_text(text)
    assert holder(tmp_path) is None
    assert holder(tmp_path / "gone") is None


def test_a_holder_counts_while_it_lives(tmp_path):
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        (tmp_path / "run.lock").write_text(f'{{"pid": {other.pid}}}')
        assert holder(tmp_path) == other.pid
    assert holder(tmp_path) is None


def test_a_place_that_cannot_be_written_gets_a_letter(tmp_path):
    with pytest.raises(RunFolderError, match=r"run\.lock: cannot be written \(No such file or directory\)"):
        RunLock(tmp_path / "gone")
    assert "(of no name)" in str(run_lock.unwritable(tmp_path, OSError("of no name")))


def test_on_windows_one_byte_far_behind_the_text_is_locked(tmp_path, monkeypatch):
    calls = []
    stand_in = SimpleNamespace(LK_NBLCK=2, LK_UNLCK=0)
    stand_in.locking = lambda handle, mode, count: calls.append((mode, count, os.lseek(handle, 0, os.SEEK_CUR)))
    monkeypatch.setitem(sys.modules, "msvcrt", stand_in)
    monkeypatch.setattr(sys, "platform", "win32")
    held = lock(tmp_path / "a.lock")
    assert calls == [(2, 1, 1_048_576)]
    assert (tmp_path / "a.lock").read_text().startswith('{"pid"'), "the words stand at the beginning"
    held.release()
    assert calls[1:] == [(0, 1, 1_048_576)]
