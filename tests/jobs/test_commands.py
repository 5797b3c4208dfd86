"""`racecraft jobs` and `--detach` as a user types them, with the real supervisor behind them."""

import json
import os
import signal
import subprocess
import sys
import time
import tty

import pytest
from tests.cli.conftest import racecraft  # noqa: F401 - the fixture
from tests.jobs.conftest import supervisor_of
from tests.jobs.makers import wait_until

from racecraft.formats.job_spec import JobSpec, JobSpecError, read_job_spec, write_job_spec
from racecraft.jobs.supervisor_start import is_supervised

TINY = ("--no-pictures", "--set=rollout.horizon=16", "--set=evaluation.episodes=1")


def test_a_detached_training_is_watched_stopped_resumed_and_forgotten(racecraft, home, tmp_path):  # noqa: F811
    said = racecraft("gym", "train", "CartPole-v1", "--stop", "iterations=3", "--detach", *TINY)
    assert said.code == 0, said.err
    assert "job gym-1 goes on by itself, run runs/gym-1" in said.out
    followed = racecraft("jobs", "logs", "-f", "gym-1")
    assert "stopped: iterations=3" in followed.out
    as_json = racecraft("jobs", "logs", "gym-1", "--json")
    assert json.loads(as_json.out) == {"job": "gym-1", "log": str(home.log("gym-1"))}
    assert as_json.err == followed.out, "the log leaves standard output to the object"
    assert racecraft("jobs", "wait", "gym-1").out == "gym-1: Completed\n"
    told = json.loads(racecraft("jobs", "show", "gym-1", "--json").out)
    assert (told["status"], told["attempts"], told["run"]) == ("Completed", 1, str(tmp_path / "runs" / "gym-1"))
    assert told["spec"]["command"][:2] == ["gym", "train"]
    assert "gym-1  Completed" in racecraft("jobs", "list").out

    refused = racecraft("jobs", "resume", "gym-1", "--stop", "iterashuns=5")
    assert (refused.code, "Did you mean 'iterations'?" in refused.err) == (2, True)
    assert racecraft("jobs", "list").out.count("Completed") == 1, "what has ended well stays so"
    assert racecraft("jobs", "resume", "gym-1", "--stop", "iterations=5").code == 0
    assert racecraft("jobs", "wait", "gym-1").code == 0
    rows = (tmp_path / "runs" / "gym-1" / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(row)["iteration"] for row in rows] == [1, 2, 3, 4, 5]
    assert racecraft("jobs", "delete", "gym-1").code == 0
    assert json.loads(racecraft("jobs", "list", "--json").out) == {"jobs": []}
    assert (tmp_path / "runs" / "gym-1" / "job.json").exists(), "what was trained stays"
    assert not home.folder("gym-1").exists()


def test_a_job_typed_with_values_behind_their_options_goes_on_after_a_kill(racecraft, home, tmp_path):  # noqa: F811
    asked = ("gym", "train", "CartPole-v1", "--stop", "iterations=60", "--no-pictures", "--set", "rollout.horizon=64")
    asked += ("--set", "evaluation.every=60", "--set", "evaluation.episodes=1", "--set", "ppo.epochs=1")
    assert racecraft("jobs", "run", "--cores", "1", "--name", "cart", *asked).code == 0
    metrics = tmp_path / "runs" / "cart" / "metrics.jsonl"
    wait_until(lambda: metrics.exists() and metrics.read_text().count("\n") >= 3)
    os.kill(json.loads((tmp_path / "runs" / "cart" / "run.lock").read_text())["pid"], signal.SIGKILL)
    assert racecraft("jobs", "wait", "cart").out == "cart: Completed\n"
    told = json.loads(racecraft("jobs", "show", "cart", "--json").out)
    assert told["attempts"] == 2
    rows = [json.loads(row)["iteration"] for row in metrics.read_text().splitlines()]
    assert rows == list(range(1, 61))


def test_what_cannot_be_trained_is_said_at_once_and_makes_no_job(racecraft, home):  # noqa: F811
    for words, letter in (
        (("gym", "train", "CartPole-v1", "--set", "ppo.learnin_rate=1"), "Did you mean 'learning_rate'"),
        (("train", "--track", "Ovl_track"), "Oval_track"),
        (("snakes", "train", "--stop", "laps"), "can never hold here"),
        (("unity", "train", "builtin:Basik"), "Basic"),
        (("gym", "train", "--run", "gone", "--resume"), "no such folder"),
    ):
        said = racecraft(*words, "--detach")
        assert (said.code, letter in said.err) == (2, True), said.err
    said = racecraft("jobs", "run", *words)  # which tries any command in a process of its own
    assert (said.code, letter in said.err) == (2, True), said.err
    assert home.store().jobs() == []
    assert supervisor_of(home) == []


def test_letters_of_the_jobs_commands(racecraft, home, tmp_path):  # noqa: F811
    (tmp_path / "job.json").write_text('{"format": "racecraft job", "version": 1, "comand": ["gym"]}')
    (tmp_path / "some.py").touch()
    for words, letter in (
        (("jobs", "show", "gym-1"), "There is no job 'gym-1'"),
        (("jobs", "run", "gmy", "train"), "Did you mean 'gym'"),
        (("jobs", "run", "job.json"), "job.json:1: comand: an unknown field; expected one of a job's"),
        (("jobs", "run", "--name", "no_good", "gym", "train", "CartPole-v1"), "is no name of a job"),
        (("jobs", "run", "--cores", "4096", "gym", "train", "CartPole-v1"), "takes 4096 cores"),
    ):
        said = racecraft(*words)
        assert (said.code, letter in said.err) == (2, True), said.err
    assert home.store().jobs() == []


def test_a_job_file_is_run(racecraft, home, tmp_path):  # noqa: F811
    (tmp_path / "hello.py").write_text("import os; print('hello', os.environ['WHO'])\n")
    write_job_spec(tmp_path / "my_job.json", JobSpec(("run", "hello.py"), environment={"WHO": "you"}, cores=1))
    assert json.loads(racecraft("jobs", "run", "--json", "my_job.json").out)["job"] == "my-job-1"
    assert racecraft("jobs", "wait", "my-job-1").code == 0
    assert racecraft("jobs", "logs", "my-job-1").out == "hello you\n"


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ('{"version": 2, "command": ["gym"]}', "version: 2; expected 1. A newer racecraft"),
        ('{"command": ["rm", "-rf"]}', "the first of run, serve"),
        ('{"name": "x"}', 'no "command"'),
        ("{", "no valid JSON"),
    ],
)
def test_a_job_file_that_is_none_is_said_with_its_line(tmp_path, text, letter):
    (tmp_path / "job.json").write_text(text)
    with pytest.raises(JobSpecError) as told:
        read_job_spec(tmp_path / "job.json")
    assert letter in str(told.value)


@pytest.mark.skipif(sys.platform == "win32", reason="terminals")
def test_a_training_goes_on_when_its_terminal_is_closed(home, tmp_path):
    import fcntl
    import termios

    ours, theirs = os.openpty()
    tty.setraw(theirs)

    def at_this_terminal():
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which `nohup` may have told this suite to pass over
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    command = f"{sys.executable} -m racecraft gym train CartPole-v1 --stop iterations=30 --detach {' '.join(TINY)}"
    shell = subprocess.Popen(
        ["sh", "-c", f"{command}; echo over; sleep 99"],
        cwd=tmp_path,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
        preexec_fn=at_this_terminal,
    )
    os.close(theirs)
    said = b""
    while b"over" not in said:
        said += os.read(ours, 1000)
    os.close(ours)  # the terminal is closed: whoever belongs to it hears SIGHUP
    assert shell.wait(60) != 0
    store = home.store()
    job = store.find("gym-1")
    assert not job.ended, "it is still at work, or the test shows nothing"
    wait_until(lambda: store.find("gym-1").ended)
    assert store.find("gym-1").status == "Completed", store.find("gym-1").reason
    store.close()


def test_a_supervisor_without_work_goes_home(home, monkeypatch):
    from racecraft.jobs.supervisor import Supervisor, _work

    store = home.store()
    begin = time.monotonic()
    _work(Supervisor(store, home), 0.5)
    assert time.monotonic() - begin < 60
    assert not is_supervised(home)
    store.close()
