"""An interpreter that imports before its job comes: the job cannot tell, and nobody is left behind where none comes."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from tests.jobs.makers import home_in, turn_until, wait_until
from tests.jobs.memory_store import MemoryStore

from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.job import new_job
from racecraft.jobs.preload import NOTE, VARIABLE, WARM_NOTE, PreloadedProcess, is_awaited
from racecraft.jobs.states import State
from racecraft.jobs.supervisor import Supervisor

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")

SUMMARY = JobSpec(("dr", "summary"), "asks", cores=0, environment={"DR_RUN_ID": "7"})


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("DR_DIR", str(tmp_path / "elsewhere"))
    made = home_in(tmp_path / "home")
    made.path.mkdir()
    made.folder("asks").mkdir()
    return made


@pytest.fixture
def here(tmp_path):
    """A folder that the job works in; its supervisor was begun somewhere else."""
    folder = tmp_path / "my cars"
    folder.mkdir()
    (folder / "run.env").write_text("DR_WORLD_NAME=Oval_track\n")
    return folder


def job_in(folder):
    return replace(SUMMARY, folder=str(folder), environment={**SUMMARY.environment, "DR_DIR": "."})


def announce(home, pid=None):
    (home.path / NOTE).write_text(f'{{"pid": {pid or os.getpid()}}}')


def is_alive(spare):
    return spare._process.poll() is None


def test_a_job_that_was_announced_gets_the_process_that_waits_and_cannot_tell(home, here):
    """Its folder, its variables, its log and its words are its own."""
    announce(home)
    store = MemoryStore()
    supervisor = Supervisor(store, home, "me", Capacity(2, 2000), spare=PreloadedProcess.if_awaited(home))
    waits = supervisor._spare._process.pid
    supervisor.reconcile()
    assert supervisor._spare is not None
    assert supervisor.turn_seconds < 0.1
    store.add(new_job(job_in(here), 0.0))
    (home.path / NOTE).unlink()
    supervisor.reconcile()
    assert (store.find("asks").process, supervisor._spare) == (waits, None)
    turn_until(supervisor, lambda: store.find("asks").ended)
    assert store.find("asks").state is State.COMPLETED, home.log("asks").read_text()
    plain = subprocess.run(
        [sys.executable, "-m", "racecraft", *SUMMARY.command], cwd=here, capture_output=True, text=True, check=True,
        env={**os.environ, **job_in(here).environment},
    )  # fmt: skip
    assert "run id        7" in plain.stdout
    assert home.log("asks").read_text() == plain.stdout


def test_what_cannot_be_imported_ahead_is_left_to_the_job(here):
    """Without PyTorch a job that needs none ran all the same, if only its own interpreter began it."""
    log = here / "log"
    told = {"words": ["dr", "summary"], "folder": str(here), "environment": {**os.environ}, "log": str(log)}
    code = "import sys; from racecraft.jobs.preload import await_words; await_words(['no_such_guest']); print(sys.argv)"
    subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(told) + "\n", text=True, check=True,
        env={**os.environ, VARIABLE: "1"},
    )  # fmt: skip
    assert log.read_text() == "['-c', 'dr', 'summary']\n"


def test_who_announces_and_brings_nothing_leaves_nobody_waiting(home):
    announce(home)
    supervisor = Supervisor(MemoryStore(), home, "me", Capacity(2, 2000))
    supervisor.reconcile()
    spare = supervisor._spare
    assert is_alive(spare)
    (home.path / NOTE).unlink()
    supervisor.reconcile()
    assert (supervisor._spare, is_alive(spare)) == (None, False)


def test_a_supervisor_that_ends_takes_the_one_that_waits_along(home):
    announce(home)
    supervisor = Supervisor(MemoryStore(), home, "me", Capacity(2, 2000), spare=PreloadedProcess.if_awaited(home))
    spare = supervisor._spare
    supervisor.close()
    assert not is_alive(spare)
    spare = PreloadedProcess(home)
    spare._process.stdin.close()  # as when a supervisor is killed
    wait_until(lambda: not is_alive(spare))


def test_nobody_waits_for_one_who_is_gone_or_takes_too_long(home):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    announce(home, gone.pid)
    assert not is_awaited(home)
    announce(home)
    assert is_awaited(home)
    os.utime(home.path / NOTE, (0, 0))
    assert not is_awaited(home)
    (home.path / NOTE).write_text("{")
    assert not is_awaited(home)


@pytest.mark.parametrize(
    "other",
    [
        {"environment": {"OMP_NUM_THREADS": "3"}},
        {"python": "/usr/bin/env"},
    ],
)
def test_a_job_whose_own_interpreter_would_be_another_gets_its_own(home, here, other):
    spare = PreloadedProcess(home)
    assert spare.assign(replace(job_in(here), **other), home.log("asks")) is None
    os.killpg(spare._process.pid, signal.SIGKILL)
    spare._process.wait()
    assert spare.assign(job_in(here), home.log("asks")) is None, "it has ended"
    spare.dismiss()


def test_a_worker_is_kept_warm_while_who_wants_it_lives_and_a_new_one_follows_a_job(home, here, monkeypatch):
    monkeypatch.setattr(PreloadedProcess, "is_ready", True)
    store = MemoryStore()
    supervisor = Supervisor(store, home, "me", Capacity(2, 2000))
    assert not supervisor.reconcile()
    (home.path / WARM_NOTE).write_text(f'{{"pid": {os.getpid()}}}')
    assert supervisor.reconcile(), "it stays, though there is no job"
    first = supervisor._spare
    assert first.warm
    assert is_alive(first)
    store.add(new_job(job_in(here), 1.0))
    supervisor.reconcile()
    assert store.find("asks").process == first._process.pid
    assert supervisor._spare is None, "the job's first lap comes first"
    monkeypatch.setattr("racecraft.jobs.supervisor.WARM_AFTER_SECONDS", -1.0)
    supervisor.reconcile()
    second = supervisor._spare
    (home.path / WARM_NOTE).unlink()
    supervisor.reconcile()
    assert not is_alive(second)
    supervisor.close()


def test_a_job_does_not_wait_for_a_worker_that_is_not_warm_yet(home, here):
    (home.path / WARM_NOTE).write_text(f'{{"pid": {os.getpid()}}}')
    store = MemoryStore()
    supervisor = Supervisor(store, home, "me", Capacity(2, 2000))
    supervisor.reconcile()
    cold = supervisor._spare
    assert not cold.is_ready
    store.add(new_job(job_in(here), 1.0))
    supervisor.reconcile()
    assert store.find("asks").process != cold._process.pid
    assert not is_alive(cold), "it would take time from the training"
    supervisor.close()
