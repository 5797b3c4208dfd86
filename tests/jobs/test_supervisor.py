"""A supervisor with real processes: what ends, dies, waits, makes room, is stopped; and nothing is left running."""

import json
import os
import signal
import sys
import time

import pytest
from tests.forked import ran
from tests.jobs.makers import add, home_in, kill_hard, python, running, script_job, state_of, turn_until, wait_until
from tests.jobs.memory_store import MemoryStore

from racecraft.contract.errors import RunFolderError
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_lock import RunLock
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.states import JobError, State
from racecraft.jobs.store import change
from racecraft.jobs.submit import request_stop, wait
from racecraft.jobs.supervisor import Supervisor

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


@pytest.fixture
def store():
    return MemoryStore()


@pytest.fixture
def working(tmp_path, store):
    """A supervisor of two cores; what it works at is ended afterwards."""
    made = Supervisor(store, home_in(tmp_path / "home"), "me", Capacity(2, 1000), grace_seconds=1.0)
    yield made
    made.close()


def ended(store, *names):
    return lambda: all(store.find(name).ended for name in names)


def states(store, name):
    return [step.state.value for step in store.find(name).transitions]


def test_a_job_completes_and_its_words_are_kept(tmp_path, store, working):
    add(store, script_job(tmp_path, "hello", "import os\nprint('hello from', os.getcwd())\n"))
    turn_until(working, ended(store, "hello"))
    assert states(store, "hello") == ["Pending", "Starting", "Training", "Completed"]
    log = home_in(tmp_path / "home").log("hello")
    assert log.read_text() == f"hello from {tmp_path}\n"
    seconds, size = home_in(tmp_path / "home").log_times("hello").read_text().split()[-2:]
    assert int(size) == log.stat().st_size
    assert abs(float(seconds) - time.time()) < 60


def test_a_job_that_fails_says_what_it_said_last(tmp_path, store, working):
    add(store, script_job(tmp_path, "wrong", "raise ValueError('the sea is dry')\n"))
    turn_until(working, ended(store, "wrong"))
    job = store.find("wrong")
    assert (job.status, job.reason) == ("Failed", "exit code 1: ValueError: the sea is dry")


def test_what_a_signal_ended_is_started_again(tmp_path, store, working):
    once = "import os, pathlib, signal\nmark = pathlib.Path('once')\n"
    once += "if not mark.exists():\n    mark.touch()\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    add(store, script_job(tmp_path, "killed", once))
    turn_until(working, ended(store, "killed"))
    wanted = ["Pending", "Starting", "Training", "Interrupted", "Restarting", "Training", "Completed"]
    assert states(store, "killed") == wanted
    assert store.find("killed").transitions[3].message == "ended by SIGKILL"


def test_what_dies_every_time_is_given_up(tmp_path, store, working):
    add(store, script_job(tmp_path, "dies", "import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n"))
    turn_until(working, ended(store, "dies"))
    job = store.find("dies")
    assert (job.state, job.attempts) == (State.FAILED, 3)
    assert job.reason.startswith("ended by SIGSEGV, 3 times in a row")


def test_what_does_not_fit_waits_and_nobody_overtakes(tmp_path, store, working):
    note = "open('order', 'a').write('{0} %s\\n')\n"
    here = f"import time\n{note % 'begins'}time.sleep({{1}})\n{note % 'ends'}"
    for at, (name, cores, seconds) in enumerate((("first", 1, 1.0), ("large", 2, 0.2), ("small", 1, 0.0))):
        add(store, script_job(tmp_path, name, here.format(name, seconds), cores=cores), created=float(at))
    turn_until(working, ended(store, "first", "large", "small"))
    assert (tmp_path / "order").read_text().split("\n")[:-1] == [
        "first begins", "first ends", "large begins", "large ends", "small begins", "small ends",
    ]  # fmt: skip


def test_a_spot_job_makes_room_and_goes_on_afterwards(tmp_path, store, working):
    once = "import os, time\nif not os.path.exists('up'):\n    open('up', 'w').close()\n    time.sleep(60)\n"
    add(store, script_job(tmp_path, "spot", once, cores=2, use_spot_instances=True))
    turn_until(working, (tmp_path / "up").exists)
    add(store, script_job(tmp_path, "paid", "print('here')\n"))
    turn_until(working, ended(store, "paid", "spot"))
    assert states(store, "spot")[3:] == ["Interrupted", "Restarting", "Training", "Completed"]
    assert store.find("spot").transitions[3].message == "made room for a job that goes before it"
    assert states(store, "paid")[-1] == "Completed"


def test_a_job_whose_time_is_over_is_stopped(tmp_path, store, working):
    add(store, script_job(tmp_path, "long", "import time\ntime.sleep(60)\n", max_run_seconds=1))
    turn_until(working, ended(store, "long"))
    job = store.find("long")
    assert (job.state, job.status, job.reason) == (State.MAX_RUNTIME_EXCEEDED, "Stopped", "1 s to train are over")


def test_a_job_that_waits_too_long_never_begins(tmp_path, store, working):
    add(store, script_job(tmp_path, "blocks", "import time\ntime.sleep(60)\n", cores=2))
    add(store, script_job(tmp_path, "waits", "print()\n", max_wait_seconds=1))
    turn_until(working, ended(store, "waits"))
    assert store.find("waits").state is State.MAX_WAIT_TIME_EXCEEDED
    assert states(store, "waits") == ["Pending", "MaxWaitTimeExceeded"]


@pytest.mark.parametrize("stubborn", [False, True])
def test_a_script_that_is_stopped_ends_with_all_it_started(tmp_path, store, working, stubborn):
    text = "import signal, subprocess, sys, time\n"
    text += "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n" if stubborn else ""
    text += "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)'])\nopen('up', 'w')\ntime.sleep(99)\n"
    mark = f"stops-{stubborn}-{os.getpid()}"
    add(store, script_job(tmp_path, "stops", text, mark=mark))
    turn_until(working, (tmp_path / "up").exists)
    assert len(running(mark)) == 2
    ask_to_stop_in(store, "stops")
    turn_until(working, ended(store, "stops"))
    assert state_of(store, "stops") is State.STOPPED
    wait_until(lambda: running(mark) == [])


def ask_to_stop_in(store, name):
    change(store, name, lambda job: job.with_stop_requested(time.time(), "asked to stop"))


def test_what_a_job_leaves_running_is_ended(tmp_path, store, working):
    mark = f"leaves-{os.getpid()}"
    text = "import subprocess, sys\nsubprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)'])\n"
    add(store, script_job(tmp_path, "leaves", text, mark=mark))
    turn_until(working, ended(store, "leaves"))
    assert state_of(store, "leaves") is State.COMPLETED
    wait_until(lambda: running(mark) == [])


def test_a_job_that_somebody_else_took_up_is_let_go(tmp_path, store, working):
    mark = f"taken-{os.getpid()}"
    add(store, script_job(tmp_path, "taken", "import time\ntime.sleep(99)\n", mark=mark))
    turn_until(working, lambda: state_of(store, "taken") is State.TRAINING)
    change(store, "taken", lambda job: job.interrupted(time.time(), "lost", True).claimed("you", time.time()))
    working.reconcile()
    wait_until(lambda: running(mark) == [])
    assert store.find("taken").owner == "you"


def test_a_folder_that_is_gone_fails_the_job_and_not_the_supervisor(tmp_path, store, working):
    add(store, JobSpec(("run", "x.py"), "nowhere", folder=str(tmp_path / "gone"), cores=1, memory_mib=1))
    add(store, script_job(tmp_path, "after", "print()\n"))
    turn_until(working, ended(store, "nowhere", "after"))
    assert "gone" in store.find("nowhere").reason
    assert state_of(store, "after") is State.COMPLETED


SUPERVISE = """
import sys, time
from pathlib import Path
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.supervisor import Supervisor
home = JobPaths(Path(sys.argv[1]), sys.argv[2])
supervisor = Supervisor(home.store(), home, sys.argv[3], Capacity(4, 1000), lost_seconds=float(sys.argv[4]))
while supervisor.reconcile(): time.sleep(0.01)
"""


def supervise(tmp_path, name, lost=60.0):
    home = tmp_path / f"home of {name}"
    home.mkdir(exist_ok=True)
    return python(SUPERVISE, home, home_in(tmp_path).store_url, name, lost)


def test_two_supervisors_that_race_never_run_one_job_twice(tmp_path):
    """Two real processes on one store; every script notes that it ran, and would see another of its kind."""
    store = home_in(tmp_path).store()
    text = "import os, time\nos.mkdir(os.path.basename(__file__) + '.up')\ntime.sleep(0.2)\n"
    names = [f"j-{number}" for number in range(8)]
    for name in names:
        add(store, script_job(tmp_path, name, text))
    both = [supervise(tmp_path, name) for name in ("left", "right")]
    assert [one.wait(120) for one in both] == [0, 0]
    for name in names:
        job = store.find(name)
        assert (job.state, job.attempts) == (State.COMPLETED, 1), job.reason
        assert (tmp_path / f"{name}.py.up").is_dir()
    homes = [{log.parent.name for log in tmp_path.glob(f"home of {name}/*/log.txt")} for name in ("left", "right")]
    assert homes[0] | homes[1] == set(names)
    assert not homes[0] & homes[1]
    store.close()


def test_a_supervisor_that_is_killed_takes_its_jobs_with_it_and_another_goes_on(tmp_path):
    store = home_in(tmp_path).store()
    mark = f"orphan-{os.getpid()}"
    text = "import subprocess, sys, time, pathlib\nagain = pathlib.Path('up').exists()\nopen('up', 'w')\n"
    text += "sleep = [sys.executable, '-c', 'import time; time.sleep(99)']\n"
    text += "if not again:\n    subprocess.Popen(sleep)\n    time.sleep(99)\n"
    add(store, script_job(tmp_path, "orphan", text, mark=mark))
    first = supervise(tmp_path, "first")
    wait_until((tmp_path / "up").exists)
    wait_until(lambda: len(running(mark)) == 2)
    kill_hard(first)
    wait_until(lambda: running(mark) == [])
    assert state_of(store, "orphan") is State.TRAINING, "nobody has noticed yet"
    second = supervise(tmp_path, "second", lost=0.5)
    assert second.wait(60) == 0
    job = store.find("orphan")
    assert (job.state, job.attempts) == (State.COMPLETED, 2)
    assert "lost with its supervisor first" in [step.message for step in job.transitions]
    store.close()


def training_job(folder, name):
    words = ("gym", "train", "CartPole-v1", "--stop=iterations=24", "--set=evaluation.episodes=2")
    words += ("--set=rollout.horizon=16", "--no-pictures")
    return JobSpec(
        (*words, f"--run={name}"),
        name,
        resume=("gym", "train", f"--run={name}", "--resume", "--no-pictures"),
        run=name,
        folder=str(folder),
        environment={"PYTHONPATH": os.environ.get("PYTHONPATH", ""), "racecraft-test-job": f"{name}-{os.getpid()}"},
        cores=1,
        memory_mib=1,
    )


def train_unbroken(folder, name):
    done = ran(training_job(folder, name).command, folder)
    assert done.returncode == 0, done.stderr


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def iterations(run):
    metrics = run / "metrics.jsonl"
    return len(metrics.read_text().splitlines()) if metrics.exists() else 0


def test_a_training_that_is_killed_with_its_supervisor_goes_on_with_the_same_curve(tmp_path):
    store = home_in(tmp_path).store()
    train_unbroken(tmp_path, "unbroken")
    add(store, training_job(tmp_path, "broken"))
    first = supervise(tmp_path, "first")
    wait_until(lambda: iterations(tmp_path / "broken") >= 3)
    kill_hard(first)
    wait_until(lambda: running(f"broken-{os.getpid()}") == [])
    assert supervise(tmp_path, "second", lost=0.5).wait(120) == 0
    job = store.find("broken")
    assert (job.state, job.attempts) == (State.COMPLETED, 2)
    assert curve(tmp_path / "broken") == curve(tmp_path / "unbroken")
    store.close()


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_kills_at_random_moments_of_supervisors_and_trainings(tmp_path, seed):
    import random

    chance = random.Random(seed)
    store = home_in(tmp_path).store()
    add(store, training_job(tmp_path, "broken"))
    supervisor = supervise(tmp_path, "0", lost=0.5)
    for number in range(1, 4):
        time.sleep(chance.uniform(0.5, 6.0))
        job = store.find("broken")
        if chance.random() < 0.5 and job.process:
            os.kill(job.process, signal.SIGKILL)
        else:
            kill_hard(supervisor)
            supervisor = supervise(tmp_path, str(number), lost=0.5)
    supervisor.wait(120)
    assert store.find("broken").state is State.COMPLETED, store.find("broken").reason
    train_unbroken(tmp_path, "whole")
    assert curve(tmp_path / "broken") == curve(tmp_path / "whole")
    assert running(f"broken-{os.getpid()}") == []
    store.close()


def test_a_training_that_is_stopped_keeps_what_it_learned_and_goes_on(tmp_path, store, working):
    spec = training_job(tmp_path, "stopped")
    add(store, spec)
    turn_until(working, lambda: iterations(tmp_path / "stopped") >= 2)
    ask_to_stop_in(store, "stopped")
    turn_until(working, ended(store, "stopped"))
    assert state_of(store, "stopped") is State.STOPPED
    assert "stop requested" in home_in(tmp_path / "home").log("stopped").read_text(), "asked in its run folder"
    before = iterations(tmp_path / "stopped")
    assert 2 <= before < 24
    change(store, "stopped", lambda job: job.resumed(time.time()))
    turn_until(working, ended(store, "stopped"))
    assert state_of(store, "stopped") is State.COMPLETED
    assert iterations(tmp_path / "stopped") == 24


def test_stopping_what_nobody_works_at_starts_nobody(tmp_path):
    home = home_in(tmp_path / "home")
    (tmp_path / "home").mkdir()
    store = home.store()
    add(store, script_job(tmp_path, "waits", "print()\n"))
    stopped = request_stop(home, store, "waits")
    assert (stopped.state, stopped.reason) == (State.STOPPED, "stopped before it began")
    assert not (home.path / "supervisor.log").exists()
    store.close()


def test_one_who_waits_is_told_why_nobody_can_work(tmp_path, store, monkeypatch):
    """A supervisor that ends by itself, as over a full disk, is not begun again and again in silence."""
    home = home_in(tmp_path)
    add(store, script_job(tmp_path, "a", "print(1)"))
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho 'racecraft: the disk is full.' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr("racecraft.jobs.supervisor_start.sys.executable", str(broken))
    monkeypatch.setattr("racecraft.jobs.submit.LOOK_AGAIN_SECONDS", 0.2)
    with pytest.raises(JobError, match="nobody can work at the jobs of .*: the disk is full. Jobs are kept"):
        wait(home, store, "a", seconds=60.0)


def test_a_lock_is_held_on_a_full_disk_too(tmp_path, monkeypatch):
    def full(handle, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("racecraft.formats.run_lock.os.write", full)
    lock = RunLock(tmp_path)
    with pytest.raises(RunFolderError, match="a process that has just begun"):
        RunLock(tmp_path)
    lock.release()


def test_one_who_waits_for_a_run_goes_on_when_it_stands_or_the_job_has_ended(tmp_path, store, working):
    from racecraft.jobs.submit import wait_for_run

    text = "import pathlib, time\npathlib.Path('r').mkdir()\npathlib.Path('r/job.json').touch()\ntime.sleep(60)\n"
    for name, script in (("stands", text), ("ended", "raise SystemExit(3)\n")):
        add(store, script_job(tmp_path, name, script, run="r" if name == "stands" else "none"))
        turn_until(working, lambda name=name: store.find(name).ended or (tmp_path / "r" / "job.json").exists())
    turn_until(working, ended(store, "ended"))
    assert state_of(store, "stands") is State.TRAINING
    assert wait_for_run(home_in(tmp_path / "home"), store, "stands").state is State.TRAINING
    assert wait_for_run(home_in(tmp_path / "home"), store, "ended").state is State.FAILED


def test_a_run_that_stood_there_before_is_neither_gone_on_with_nor_asked_to_stop(tmp_path):
    """A training with -w reads all it was given while the older model still stands."""
    from racecraft.jobs.children import current_args, has_begun, run_mark
    from racecraft.jobs.supervisor import _request_stop_in_run

    run = tmp_path / "r"
    run.mkdir()
    (run / "job.json").write_text('{"format": "racecraft run", "version": 1, "kind": "deepracer"}')
    spec = JobSpec(("dr", "a"), resume=("train", "--resume"), run=str(run), older_run=run_mark(run))
    assert (has_begun(spec), current_args(spec), _request_stop_in_run(spec)) == (False, ("dr", "a"), False)
    assert not (run / "stop").exists()
    (run / "job.json").unlink()
    assert not has_begun(spec)
    (run / "job.json").write_text('{"format": "racecraft run", "version": 1, "kind": "deepracer", "new": 1}')
    assert (has_begun(spec), current_args(spec), _request_stop_in_run(spec)) == (True, spec.resume, True)
    assert (run / "stop").exists()
