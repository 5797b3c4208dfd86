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

    def drive(self, order, tell):
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


class Stage:
    """A model, somebody else's files, and a process that tries tricks on them."""

    def __init__(self, folder):
        self.model, self.others = folder / "model", folder / "others"
        for place, name, text in ((self.model, "weights", "1"), (self.others, "secret", "a key")):
            place.mkdir()
            (place / name).write_text(text)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(drive_process, "__name__", __name__)
            patch.setattr(sys, "path", [str(Path(__file__).parents[2]), *sys.path])
            self.process = DriveProcess("k")

    def tries(self, trick, **rules):
        """Return what came of a trick, all of which leave the others' files as they were."""
        names = {"others": str(self.others), "secret": str(self.others / "secret"), "owner": os.getpid()} | rules
        order = DriveOrder(rules=names, track=trick, seed=0, models=(str(self.model),), names=("Ann",))
        done = self.process.drive(order).outcomes[0].ended
        assert (self.others / "secret").read_text() == "a key"
        assert [path.name for path in self.others.iterdir()] == ["secret"]
        return done

    def close(self):
        self.process.close()
        assert not Path(self.process._scratch.name).exists()


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """The stage of a process that has given up all but its model, once and for all: the tests share it."""
    with contextlib.closing(Stage(tmp_path_factory.mktemp("limited"))) as stage:
        assert stage.tries("open(model + '/weights').read()") == "'1'"
        assert {"seccomp", "no new privileges"} < set(stage.process.layers)
        yield stage


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
def test_what_a_drive_needs_it_may(limited, case):
    assert limited.tries(RIGHTLY[case]) in ("'1'", "1", "None", "0.3333333333333333")


@pytest.mark.parametrize("case", TRICKS)
def test_a_trick_fails(limited, case):
    assert limited.tries(TRICKS[case]) in FAILED


def test_without_the_limit_the_same_tricks_succeed(tmp_path):
    with contextlib.closing(Stage(tmp_path)) as stage:
        assert stage.tries("open(secret).read()", is_alone=False) == "'a key'"
        assert stage.process.layers == ()
