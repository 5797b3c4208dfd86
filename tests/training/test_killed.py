"""A run that is killed at any moment goes on as if it had never stopped. Real processes, real kill -9, every kind."""

import contextlib
import json
import os
import random
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tests.cli.conftest import TINY
from tests.forked import PROCESSES
from tests.jobs.makers import wait_until

from racecraft.cli.app import main
from racecraft.formats.checkpoint import Checkpoints, load_state

SMALL = ("--set", "network.hidden_units=16", "--set", "evaluation.every=2")


@dataclass(frozen=True)
class Kind:
    """One kind of training, short enough to be killed thirty times."""

    verb: tuple[str, ...]
    begun_with: tuple[str, ...]
    iterations: int
    seconds: float
    """Within which it is killed, from its first tick on; a little longer than it lasts."""


CARS = Kind(("train",), ("--no-pictures", *TINY), 12, 1.2)
GYMNASIUM = Kind(
    ("gym", "train"),
    ("CartPole-v1", "--no-pictures", "--set", "rollout.num_worlds=2", "--set", "rollout.horizon=64", *SMALL),
    12,
    1.2,
)
SNAKES = Kind(
    ("snakes", "train"),
    (
        "--no-pictures",
        "--size",
        "7",
        "--snakes",
        "2",
        "--set",
        "rollout.num_worlds=8",
        "--set",
        "rollout.horizon=16",
        *SMALL,
    )
    + ("--set", "evaluation.episodes=1"),
    12,
    3.0,
)
UNITY = Kind(
    ("unity", "train"),
    ("builtin:Basic", "--no-pictures", "--set", "rollout.num_worlds=2", "--set", "rollout.horizon=64", *SMALL),
    12,
    3.0,
)
"""Whose world is another program: it cannot come back to the same bits, but to every iteration, once.

What stands is what a checkpoint closed. The row of an iteration is written before its checkpoint: a kill between the
two has that iteration played again, and a player in another program plays it otherwise.
"""
KINDS = {"cars": CARS, "gymnasium": GYMNASIUM, "snakes": SNAKES}

MARK = "racecraft-test-killed"
"""Stands in the environment of a training and of whatever it starts, so that what is left running is found."""


def work(words, told):
    """Be `racecraft …` in this process; what it says goes to a file."""
    os.environ[MARK] = str(Path(told).with_suffix(""))
    with Path(told).open("w", buffering=1) as file:
        sys.stdout = sys.stderr = file
        sys.argv = ["racecraft", *words]
        main()


def start(kind, run, *more):
    told = run.with_suffix(".log")
    process = PROCESSES.Process(target=work, args=([*kind.verb, "--run", str(run), *more], str(told)))
    told.unlink(missing_ok=True)
    process.start()
    return process, told


def begin(kind, run):
    return start(kind, run, "--stop", f"iterations={kind.iterations}", *kind.begun_with)


def finish(process, told):
    process.join(600)
    assert process.exitcode == 0, told.read_text()


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def files(run):
    """What shall be the same bytes too: every policy and the AWS files."""
    kept = [*(run / "checkpoints").glob("*.policy.safetensors"), *(run / "training-simtrace").glob("*.csv")]
    return {path.name: path.read_bytes() for path in sorted(kept)}


def state(run):
    """What the next iteration would begin with: optimiser, chance, worlds, opponents, counts; but not the clock."""
    whole = load_state(run / "checkpoints" / f"{len(curve(run))}.state.safetensors")
    whole["loop"] = {name: value for name, value in whole["loop"].items() if not name.startswith("seconds")}
    return {name: whole[name] for name in ("learner", "collector", "loop", "parts") if name in whole}


def kill_and_resume(kind, run, moment):
    """Kill the first training `moment` s after its first tick is due; go on to the end."""
    process, told = begin(kind, run)
    while process.is_alive() and "; stops at " not in (told.read_text() if told.exists() else ""):
        time.sleep(0.005)
    process.join(moment)
    process.kill()
    process.join()
    finish(*start(kind, run, "--resume", "--no-pictures"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the run of a kind that nobody killed."""
    runs = tmp_path_factory.mktemp("runs")

    def run_of(name):
        if not (runs / name).exists():
            finish(*begin(KINDS[name], runs / name))
        return runs / name

    return run_of


def assert_same_bits(killed, whole):
    assert curve(killed) == curve(whole)
    assert files(killed) == files(whole)
    np.testing.assert_equal(state(killed), state(whole))


def test_a_kill_in_the_middle_leaves_no_trace(whole, tmp_path):
    """Of the kind that writes most; the long test kills all of them."""
    kill_and_resume(CARS, tmp_path / "killed", 0.25)
    assert_same_bits(tmp_path / "killed", whole("cars"))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("name", KINDS)
def test_thirty_kills_at_random_moments(whole, tmp_path, name, seed):
    kill_and_resume(KINDS[name], tmp_path / "killed", random.Random(seed).uniform(0.0, KINDS[name].seconds))
    assert_same_bits(tmp_path / "killed", whole(name))


def players_of(run):
    """Return the processes that a training of this run has started and that are still there."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if f"{MARK}={run}".encode() in (folder / "environ").read_bytes().split(b"\0"):
                found.append(folder.name)
    return found


def closed_by_a_checkpoint(run):
    """Return the newest iteration that a resumed training begins after; 0 where there is none."""
    return max((entry.iteration for entry in Checkpoints(run / "checkpoints").entries()), default=0)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30))
def test_a_unity_training_that_is_killed_keeps_every_iteration_and_leaves_no_player(tmp_path, seed):
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    run = tmp_path / "killed"
    process, told = begin(UNITY, run)
    while process.is_alive() and "; stops at " not in (told.read_text() if told.exists() else ""):
        time.sleep(0.005)
    process.join(random.Random(seed).uniform(0.0, UNITY.seconds))
    if (run / "metrics.jsonl").exists() and process.is_alive():
        assert players_of(run), "the player is found while it plays"
    process.kill()
    process.join()
    kept = curve(run)[: closed_by_a_checkpoint(run)] if (run / "metrics.jsonl").exists() else []
    wait_until(lambda: not players_of(run))
    finish(*start(UNITY, run, "--resume", "--no-pictures"))
    assert curve(run)[: len(kept)] == kept
    assert [row["iteration"] for row in curve(run)] == list(range(1, UNITY.iterations + 1))
    assert [row["steps"] for row in curve(run)] == [2 * 64 * n for n in range(1, UNITY.iterations + 1)]
    assert not players_of(run)
