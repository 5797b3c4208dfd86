"""The process that drives can compute, read the models that it drives, write into a folder of its own, and no more."""

import contextlib
import os
import sys
from pathlib import Path

import pytest

from racecraft.isolation.layers import can_isolate
from racecraft.league import drive_process
from racecraft.league.drive_process import DriveProcess
from racecraft.league.race import Outcome
from racecraft.league.world_part import Driven, DriveOrder

pytestmark = pytest.mark.skipif(not can_isolate(), reason="this system isolates no code")


class Tricks:
    """A world whose drive does what the models' folder names, as code that came in by a damaged file might."""

    def warm_up(self):
        pass

    def is_alone(self, order):
        return order.rules.get("is_alone", True)

    def drive(self, order):
        try:
            done = repr(eval(order.track, {"model": order.models[0], **order.rules}))
        except Exception as error:
            done = type(error).__name__
        return Driven((Outcome(ended=done),), {})


def main():
    """Stand in for the module's `main`, with a world of tricks."""
    drive_process.league_world = lambda kind: Tricks()
    sys.modules["tempfile"].tempdir = None
    drive_process.main()


@pytest.fixture
def tried(tmp_path, monkeypatch):
    """Return a function that tries a trick in a limited process, and what came of it."""
    monkeypatch.setattr(drive_process, "__name__", __name__)
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2]), *sys.path])
    model = tmp_path / "model"
    model.mkdir()
    (model / "weights").write_text("1")
    others = tmp_path / "others"
    others.mkdir()
    (others / "secret").write_text("a key")
    with contextlib.closing(DriveProcess("k")) as process:

        def try_out(trick, **rules):
            names = {"others": str(others), "secret": str(others / "secret"), "owner": os.getpid()} | rules
            order = DriveOrder(rules=names, track=trick, seed=0, models=(str(model),), names=("Ann",))
            return process.drive(order).outcomes[0].ended, process

        yield try_out
    assert (others / "secret").read_text() == "a key"
    assert [path.name for path in others.iterdir()] == ["secret"]
    assert not Path(process._scratch.name).exists()


def in_a_thread(trick):
    return f"__import__('concurrent.futures').futures.ThreadPoolExecutor(1).submit(lambda: {trick}).result()"


RIGHTLY = {
    "reads the model": "open(model + '/weights').read()",
    "writes into its own folder": "open(__import__('tempfile').gettempdir() + '/own', 'w').write('x')",
    "makes folders there": "__import__('tempfile').TemporaryDirectory().cleanup()",
    "starts a thread": in_a_thread("1"),
    "imports what is installed": "__import__('colorsys').ONE_THIRD",
}
TRICKS = {
    "reads a file": "open(secret).read()",
    "reads a file by its descriptor": "__import__('os').open(secret, 0)",
    "lists a folder": "__import__('os').listdir(others)",
    "looks into the home folder": "__import__('os').listdir(__import__('os').path.expanduser('~'))",
    "reads the users": "open('/etc/passwd').read()",
    "reads passwords": "open('/etc/shadow').read()",
    "writes a file": "open(others + '/new', 'w')",
    "writes over a file": "open(secret, 'w')",
    "appends to a file": "open(secret, 'a')",
    "cuts a file": "__import__('os').truncate(secret, 0)",
    "removes a file": "__import__('os').remove(secret)",
    "moves a file": "__import__('os').rename(secret, secret + '2')",
    "makes a folder": "__import__('os').mkdir(others + '/new')",
    "makes a link": "__import__('os').symlink(secret, __import__('tempfile').gettempdir() + '/link')",
    "makes a hard link": "__import__('os').link(secret, __import__('tempfile').gettempdir() + '/link')",
    "changes a mode": "__import__('os').chmod(secret, 0)",
    "writes into the model": "open(model + '/weights', 'w')",
    "removes the model": "__import__('os').remove(model + '/weights')",
    "writes into the package": "open(__import__('racecraft').__file__, 'a')",
    "writes machine code": "open(__import__('numba').config.CACHE_DIR + '-x', 'w')",
    "leaves a file for all": "open('/tmp/racecraft-was-here', 'w')",
    "starts a program": "__import__('subprocess').run(['/bin/true'])",
    "becomes a program": "__import__('os').execv('/bin/true', ['true'])",
    "forks": "__import__('os').fork()",
    "reads a file in a thread": in_a_thread("open(secret).read()"),
    "opens a socket in a thread": in_a_thread("__import__('socket').socket()"),
    "forks in a thread": in_a_thread("__import__('os').fork()"),
    "makes a process as a thread": "__import__('ctypes').CDLL(None).syscall(56, 17, 0, 0, 0, 0) == -1 and 1 // 0",
    "opens a socket": "__import__('socket').socket()",
    "asks for a name": "__import__('socket').create_connection(('127.0.0.1', 80), 1)",
    "signals its owner": "__import__('os').kill(owner, 0)",
    "reads its owner's memory": "open(f'/proc/{owner}/mem', 'rb')",
    "reads its owner's environment": "open(f'/proc/{owner}/environ', 'rb').read()",
    "slows its owner": "__import__('os').setpriority(0, owner, 19)",
    "wants all memory": "len(bytearray(64 << 30))",
    "fills the disk": "open(__import__('tempfile').gettempdir() + '/own', 'wb').write(bytes(300 << 20))",
}


FAILED = (
    "PermissionError", "OSError", "MemoryError", "BlockingIOError", "RuntimeError", "ZeroDivisionError",
)  # fmt: skip


@pytest.mark.parametrize("case", RIGHTLY)
def test_what_a_drive_needs_it_may(tried, case):
    done, process = tried(RIGHTLY[case])
    assert done in ("'1'", "1", "None", "0.3333333333333333")
    assert {"seccomp", "no new privileges"} < set(process.layers)


@pytest.mark.parametrize("case", TRICKS)
def test_a_trick_fails(tried, case):
    done, _ = tried(TRICKS[case])
    assert done in FAILED


def test_without_the_limit_the_same_tricks_succeed(tried):
    done, process = tried("open(secret).read()", is_alone=False)
    assert done == "'a key'"
    assert process.layers == ()


def test_a_process_stays_limited_and_reads_no_more_for_a_second_drive(tried):
    assert tried("open(model + '/weights').read()")[0] == "'1'"
    assert tried("open(secret).read()")[0] == "PermissionError"
