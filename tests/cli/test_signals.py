"""SIGTERM saves as Ctrl-C does; a second Ctrl-C ends without a traceback."""

import os
import signal
import subprocess
import sys
import time

import pytest

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

TRAIN = (
    "gym", "train", "CartPole-v1", "--run", "run", "--no-pictures", "--stop", "minutes=5",
    "--set", "rollout.num_worlds=2", "--set", "rollout.horizon=64", "--set", "network.hidden_units=16",
)  # fmt: skip


PRESSED_LAST = """\
import atexit, signal
atexit.register(signal.raise_signal, signal.SIGINT)
from racecraft.cli.entry import main
main()
"""
"""Ctrl-C comes while the interpreter ends, after everything else that is registered for then."""

PRESSED_TWICE = """\
import signal, sys
from racecraft.cli import table
from racecraft.cli.entry import main

class Pressed:
    def write(self, text):
        sys.stderr = sys.__stderr__
        signal.raise_signal(signal.SIGINT)

def command(**options):
    sys.stderr = Pressed()
    signal.raise_signal(signal.SIGINT)

table.app_for = lambda words: command
main()
"""
"""Ctrl-C comes again while the command tells of the first."""

PRESSED_IN_A_CALLBACK = """\
import signal, sys, time, weakref
from racecraft.cli import table
from racecraft.cli.entry import main
from racecraft.training.signals import sigterm_interrupts

class Dropped:
    pass

def command(**options):
    with sigterm_interrupts():
        dropped = Dropped()
        watched = weakref.ref(dropped, lambda _: signal.raise_signal(int(sys.argv[1])))
        del dropped
        time.sleep(300)

table.app_for = lambda words: command
main()
"""
"""The signal comes while Python calls back for a weak reference, and forgets the exceptions that come of it."""

PRESSED_WHILE_COMPILING = """\
import signal, sys, time
import typer
from numba.core import caching
from numba.core.registry import cpu_target
from racecraft.actions.action import action
from racecraft.cli import table
from racecraft.cli.entry import main
from racecraft.cli.from_request import command
from racecraft.contract.progress import quiet
from racecraft.kernels import kernel
from racecraft.settings.request import Request
from racecraft.training.signals import sigterm_interrupts

@kernel
def one_more(number):
    return number + 1

def press(*_):
    if not pressed:
        pressed.append(number)
        signal.raise_signal(int(number))

pressed = []
moment, number = sys.argv[1:]
if moment == "machine code":
    cpu_target.target_context.codegen()._engine.set_object_cache(press, lambda module: None)
if moment == "saving":
    caching.IndexDataCacheFile._save_data = press

@action
def compile_it(request: Request, progress=quiet):
    with sigterm_interrupts():
        print(one_more(1), flush=True)
        time.sleep(300 if moment != "warm" else 0)

app = typer.Typer()
app.command()(command(compile_it, str))
del sys.argv[1:]
table.app_for = lambda words: app
main()
"""
"""The signal comes while a kernel is compiled: in a callback of LLVM's, or before the kernel is on disk."""


def begin(place, *words, way_in=("-m", "racecraft")):
    """Start a training, and wait until it has written an iteration."""
    process = subprocess.Popen(
        [sys.executable, *way_in, *words],
        cwd=place,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    until = time.monotonic() + 120
    while not (place / "run" / "metrics.jsonl").is_file() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    return process


def test_sigterm_saves_as_ctrl_c_does(tmp_path):
    process = begin(tmp_path, *TRAIN)
    process.send_signal(signal.SIGTERM)
    told, _ = process.communicate(timeout=120)
    assert process.returncode == 128 + signal.SIGTERM, told
    assert "stopped: SIGTERM" in told
    assert "saved in run" in told
    assert "Traceback" not in told
    run = RunFolder.open(tmp_path / "run")
    rows = (run.path / "metrics.jsonl").read_text().splitlines()
    assert Checkpoints(run.checkpoints).find("last").iteration == len(rows) > 0


def test_a_second_ctrl_c_ends_without_a_traceback(tmp_path):
    """Whenever it comes; the two tests below choose the moments at which nobody but the way in can catch it."""
    process = begin(tmp_path, *TRAIN)
    process.send_signal(signal.SIGINT)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    told, _ = process.communicate(timeout=120)
    assert "Traceback" not in told
    assert process.returncode in (0, 130, -signal.SIGINT), told


def test_a_second_ctrl_c_while_the_interpreter_ends_is_silent(tmp_path):
    process = begin(tmp_path, *TRAIN, way_in=("-c", PRESSED_LAST))
    process.send_signal(signal.SIGINT)
    told, _ = process.communicate(timeout=120)
    assert "stopped: " in told
    assert "Traceback" not in told
    assert process.returncode == -signal.SIGINT, told


def test_a_second_ctrl_c_while_the_first_is_told_is_silent():
    ended = subprocess.run([sys.executable, "-c", PRESSED_TWICE], capture_output=True, text=True, timeout=120)
    assert ended.stderr == ""
    assert ended.returncode == -signal.SIGINT


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_a_callback_that_forgets_exceptions_ends_the_command_too(number):
    command = [sys.executable, "-c", PRESSED_IN_A_CALLBACK, str(int(number))]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert ended.stderr == "racecraft: stopped.\n"
    assert ended.returncode == 128 + number


def test_a_signal_while_a_kernel_is_compiled_ends_with_our_word_and_leaves_no_half_kernel(tmp_path):
    script = tmp_path / "compiles.py"
    script.write_text(PRESSED_WHILE_COMPILING)

    def end(moment, number):
        words = [sys.executable, script, moment, str(int(number))]
        ended = subprocess.run(words, capture_output=True, text=True, timeout=120)
        return ended.returncode, ended.stdout, ended.stderr

    assert end("saving", signal.SIGTERM) == (128 + signal.SIGTERM, "", "racecraft: stopped.\n")
    assert end("machine code", signal.SIGINT)[::2] == (128 + signal.SIGINT, "racecraft: stopped.\n")
    assert end("warm", 0) == (0, "2\n", "")
