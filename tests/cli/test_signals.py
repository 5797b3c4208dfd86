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


def begin(place, *words):
    """Start a training, and wait until it has written an iteration."""
    process = subprocess.Popen(
        [sys.executable, "-m", "racecraft", *words],
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


@pytest.mark.parametrize("pause_seconds", [0.0, 0.02, 0.1, 0.3])
def test_a_second_ctrl_c_ends_without_a_traceback(tmp_path, pause_seconds):
    process = begin(tmp_path, *TRAIN)
    process.send_signal(signal.SIGINT)
    time.sleep(pause_seconds)
    process.send_signal(signal.SIGINT)
    told, _ = process.communicate(timeout=120)
    assert "Traceback" not in told
    assert process.returncode in (0, 130, -signal.SIGINT), told
