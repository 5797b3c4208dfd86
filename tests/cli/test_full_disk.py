"""A disk that is full at any one write of a training: a letter, nothing half-written, and it goes on from there."""

import errno
import json
import os
import stat
import threading

import pytest
from tests.cli.conftest import TINY

ITERATIONS = 2


class Disk:
    """Takes so many files, and is full for the next one; then somebody frees some space."""

    def __init__(self, monkeypatch):
        self.taken, self.full_at, self.was_full = 0, None, False
        self._lock = threading.Lock()
        monkeypatch.setattr(os, "fsync", self.fsync)

    def fsync(self, handle):
        if stat.S_ISDIR(os.fstat(handle).st_mode):
            return
        with self._lock:
            self.taken += 1
            if self.taken == self.full_at:
                self.was_full = True
                raise OSError(errno.ENOSPC, "No space left on device")


def curve(folder):
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def begin(racecraft):
    return racecraft("train", "--run", "r", "--stop", f"iterations={ITERATIONS}", "--no-pictures", *TINY)


@pytest.mark.parametrize("every", [7, pytest.param(1, marks=pytest.mark.long)])
def test_at_each_write_a_full_disk_is_said_and_costs_nothing(racecraft, tmp_path, monkeypatch, every):
    disk = Disk(monkeypatch)
    assert begin(racecraft).code == 0
    writes, whole = disk.taken, curve(tmp_path / "r")
    assert writes > 20
    for number in range(1, writes + 1, every):
        (tmp_path / "r").rename(tmp_path / f"before-{number}")
        disk.taken, disk.full_at = 0, number
        said = begin(racecraft)
        assert disk.was_full, number
        assert said.code == 2, (number, said.err)
        assert "the disk is full" in said.err, (number, said.err)
        assert "Traceback" not in said.err, (number, said.err)
        assert not list(tmp_path.rglob("*.part")), number
        disk.full_at = None
        again = racecraft("train", "--run", "r", "--resume", "--stop", f"iterations={ITERATIONS}", "--no-pictures")
        if again.code:
            again = begin(racecraft)
        assert again.code == 0, (number, again.err)
        assert curve(tmp_path / "r") == whole, number
