"""A run that is killed at any moment goes on as if it had never stopped. Real processes, real kill -9."""

import json
import random
import signal
import subprocess
import sys
import time

import pytest
from tests.cli.conftest import TINY

ITERATIONS = 12


def start(run, *more):
    command = [sys.executable, "-m", "racecraft", "train", "--run", str(run), "--no-pictures", *more]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def begin(run):
    return start(run, "--stop", f"iterations={ITERATIONS}", *TINY)


def finish(process):
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 0, said
    return said


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def files(run):
    """The AWS files, which shall be the same bytes too."""
    return {path.name: path.read_bytes() for path in sorted((run / "training-simtrace").glob("*.csv"))}


def kill_and_resume(run, moment):
    """Kill the first training `moment` s after its first tick is due; go on to the end."""
    process = begin(run)
    for line in process.stdout:
        if "; stops at " in line:
            break
    time.sleep(moment)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    return finish(start(run, "--resume"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    run = tmp_path_factory.mktemp("runs") / "whole"
    finish(begin(run))
    return run


def test_a_kill_in_the_middle_leaves_no_trace_in_the_curve(whole, tmp_path):
    kill_and_resume(tmp_path / "killed", 0.25)
    assert curve(tmp_path / "killed") == curve(whole)
    assert files(tmp_path / "killed") == files(whole)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30))
def test_thirty_kills_at_random_moments(whole, tmp_path, seed):
    kill_and_resume(tmp_path / "killed", random.Random(seed).uniform(0.0, 1.2))
    assert curve(tmp_path / "killed") == curve(whole)
    assert files(tmp_path / "killed") == files(whole)
