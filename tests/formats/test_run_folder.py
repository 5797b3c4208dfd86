"""Run folders: made, opened, locked, refused."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from racecraft.contract.errors import RunFolderError
from racecraft.formats.atomic import OutputFileError
from racecraft.formats.run_folder import VERSION, RunFolder, last_stops

HOLD = """
import sys, time
from racecraft.formats.run_folder import RunFolder
with RunFolder.open(sys.argv[1]).lock():
    print("held", flush=True)
    time.sleep(60)
"""


def test_what_was_asked_comes_back_with_format_and_version(tmp_path):
    run = RunFolder.create(tmp_path / "runs" / "first", {"track": "reinvent_base", "seed": np.int64(3)})
    job = RunFolder.open(run.path).read_job()
    assert job == {"format": "racecraft run", "version": VERSION, "track": "reinvent_base", "seed": 3}
    for folder in (run.checkpoints, run.episodes, run.evaluations):
        assert folder.is_dir()


def test_numbers_go_on_from_the_highest(tmp_path):
    (tmp_path / "oval-7").mkdir(parents=True)
    (tmp_path / "oval-x").mkdir()
    names = [RunFolder.create_numbered(tmp_path, name).path.name for name in ("oval", "oval", "monaco")]
    assert names == ["oval-8", "oval-9", "monaco-1"]
    assert RunFolder.create_numbered(tmp_path / "not" / "yet", "oval").job.is_file(), "the folders above are made"


def test_metrics_come_back_and_what_is_no_number_is_null(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    assert run.read_metrics() == []
    run.append_metrics({"iteration": 0, "loss": float("nan"), "reward": np.float32(0.5), "mean": np.float64("inf")})
    run.append_metrics({"iteration": np.int32(1), "laps": [1, 2]})
    assert run.read_metrics() == [
        {"iteration": 0, "loss": None, "reward": 0.5, "mean": None},
        {"iteration": 1, "laps": [1, 2]},
    ]


@pytest.mark.parametrize("torn", ['{"iteration": 1, "lo', "x" * 10_000])
def test_a_torn_last_line_is_passed_over_and_cut_off_by_the_next(tmp_path, torn):
    run = RunFolder.create(tmp_path / "r")
    run.append_metrics({"iteration": 0})
    with open(run.metrics, "a") as file:
        file.write(torn)
    assert run.read_metrics() == [{"iteration": 0}]
    run.append_metrics({"iteration": 1})
    assert run.read_metrics() == [{"iteration": 0}, {"iteration": 1}]


def test_two_trainings_cannot_share_a_folder(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    lock = run.lock()
    with pytest.raises(RunFolderError, match=rf"another training holds it \(process {os.getpid()}, since 20"):
        RunFolder.open(tmp_path / "r").lock()
    lock.release()
    lock.release()
    with run.lock():
        pass


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is a word of POSIX")
def test_a_killed_training_holds_nothing(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(run.path)], stdout=subprocess.PIPE, text=True)
    with holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(RunFolderError, match=f"process {holder.pid}"):
            run.lock()
        holder.send_signal(signal.SIGKILL)
        holder.wait()
    with run.lock():
        pass


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_neither_keeps_nor_frees_the_folder(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    lock = run.lock()
    read, write = os.pipe()
    ready, say_ready = os.pipe()
    child = os.fork()
    if child == 0:  # the child lives on until it is told to end, as an orphan would
        os.close(write)
        os.write(say_ready, b"!")
        os.read(read, 1)
        os._exit(0)
    os.close(read)
    os.read(ready, 1)
    try:
        with pytest.raises(RunFolderError, match="another training"):
            run.lock()
        os.close(lock._handle)  # what the system does to a killed process
        lock._handle = None
        with run.lock():
            pass
    finally:
        for handle in (write, ready, say_ready):
            os.close(handle)
        os.waitpid(child, 0)


def foreign(path):
    path.mkdir()
    (path / "holiday.jpg").write_bytes(b"")


def a_file(path):
    path.write_text("")


def job_text(text):
    def write(path):
        path.mkdir()
        (path / "job.json").write_text(text)

    return write


REFUSED = [  # how the place is made, how it is used, what the message holds
    (lambda path: None, RunFolder.open, "no such folder"),
    (foreign, RunFolder.open, "holds no job.json"),
    (a_file, RunFolder.open, "a file stands in its place"),
    (job_text('{"format": "other"}'), RunFolder.open, "not written by racecraft"),
    (job_text('{"format": "racecraft run",\n "ver'), RunFolder.open, "job.json:2: no valid JSON"),
    (job_text('{"format": "racecraft run", "version": 99}'), RunFolder.open, "version is 99; expected 1 to"),
    (job_text('{"format": "racecraft run", "version": "1"}'), RunFolder.open, "version is '1'"),
    (job_text("null"), RunFolder.open, "not written by racecraft"),
    (foreign, RunFolder.create, "holds files that are no run"),
    (a_file, RunFolder.create, "a file stands in its place"),
    (RunFolder.create, RunFolder.create, "a run stands here already"),
    (a_file, lambda path: RunFolder.create_numbered(path, "oval"), "a file stands in its place"),
    (a_file, lambda path: RunFolder.create(path / "below"), "cannot be written"),
]


@pytest.mark.parametrize(("make", "use", "found"), REFUSED)
def test_what_is_no_place_for_a_run_gets_a_letter(tmp_path, make, use, found):
    path = tmp_path / "place"
    make(path)
    with pytest.raises(RunFolderError) as caught:
        use(path)
    assert str(caught.value).startswith(str(path))
    assert found in str(caught.value)
    assert "expected" in str(caught.value)


def test_a_damaged_line_in_the_middle_is_named(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    run.metrics.write_text('{"iteration": 0}\noops\n{"iteration": 2}\n')
    with pytest.raises(RunFolderError, match=r"metrics\.jsonl:2: b'oops' is no JSON; expected one object a line"):
        run.read_metrics()


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_place_without_permission_gets_a_letter(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(RunFolderError, match="cannot be written"):
        RunFolder.create(tmp_path / "r")
    tmp_path.chmod(0o700)


def test_a_read_only_place_gets_a_letter_even_for_the_administrator(tmp_path, monkeypatch):
    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "mkdir", refuse)
    with pytest.raises(RunFolderError, match=r"cannot be written \(Permission denied\)"):
        RunFolder.create(tmp_path / "r")


def test_a_run_whose_birth_was_broken_off_is_none_and_its_place_is_free(tmp_path):
    def full(run):
        run.reward_function.write_text("half")
        raise OutputFileError("the disk is full")

    with pytest.raises(OutputFileError):
        RunFolder.create(tmp_path / "r", {}, full)
    with pytest.raises(RunFolderError, match="holds no job.json"):
        RunFolder.open(tmp_path / "r")
    run = RunFolder.create(tmp_path / "r", {"n": 1}, lambda run: run.reward_function.write_text("whole"))
    assert (run.read_job()["n"], run.reward_function.read_text()) == (1, "whole")


@pytest.mark.parametrize("stranger", ["reward_function.py", "checkpoints/1.policy.safetensors", "notes.txt"])
def test_a_folder_that_somebody_works_in_is_never_taken_for_an_unborn_run(tmp_path, stranger):
    path = tmp_path / "car" / stranger
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(RunFolderError, match="holds files that are no run"):
        RunFolder.create(tmp_path / "car")


def test_of_two_that_make_one_folder_at_once_one_is_refused(tmp_path):
    def quicker(run):
        RunFolder.create(tmp_path / "r")

    with pytest.raises(RunFolderError, match="another training holds it"):
        RunFolder.create(tmp_path / "r", {}, quicker)


def test_what_was_told_after_the_checkpoint_that_a_run_goes_on_from_is_cut(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    run.cut_metrics(3)
    assert not run.metrics.exists(), "nothing was told, nothing is written"
    for iteration in range(4):
        run.append_metrics({"iteration": iteration, "reward": 0.5 * iteration})
    run.cut_metrics(2)
    assert [row["iteration"] for row in run.read_metrics()] == [0, 1, 2]


@pytest.mark.parametrize("length", [4095, 4096, 8192])
def test_a_torn_line_is_cut_off_however_long_it_is(tmp_path, length):
    """Around the sizes in which files are read backwards."""
    run = RunFolder.create(tmp_path / "r")
    run.metrics.write_text('{"iteration": 0}\n' + "x" * length)
    run.append_metrics({"iteration": 1})
    assert run.metrics.read_text() == '{"iteration": 0}\n{"iteration": 1}\n'


def test_a_number_that_somebody_was_quicker_with_is_passed_over(tmp_path, monkeypatch):
    RunFolder.create(tmp_path / "oval-1")
    RunFolder.create(tmp_path / "oval-2")
    monkeypatch.setattr(type(tmp_path), "iterdir", lambda self: iter(()))
    assert RunFolder.create_numbered(tmp_path, "oval").path.name == "oval-3"


def test_what_a_run_goes_on_for_is_added_to_what_was_asked(tmp_path):
    run = RunFolder.create(tmp_path / "r", {"asked": {"stops": ["laps=3"]}})
    assert last_stops(run.read_job()) == ("laps=3",)
    run.note_resumed(4, ["minutes=7"])
    run.note_resumed(6, [])
    assert last_stops(run.read_job()) == ()
    run.note_resumed(9, ("hours=1", "laps=9"))
    assert run.read_job()["resumed"] == [
        {"after_iteration": 4, "stops": ["minutes=7"]},
        {"after_iteration": 6, "stops": []},
        {"after_iteration": 9, "stops": ["hours=1", "laps=9"]},
    ]
    assert last_stops(run.read_job()) == ("hours=1", "laps=9")
    assert last_stops({}) == last_stops({"asked": {"stops": None}}) == ()
    assert run.job.read_text().startswith('{\n  "format": "racecraft run",\n  "version": 1,')


def test_a_run_is_of_the_kind_that_is_asked_for_or_is_refused(tmp_path):
    run = RunFolder.create(tmp_path / "r", {"kind": "deepracer"})
    assert run.read_job_of("deepracer")["kind"] == "deepracer"
    with pytest.raises(RunFolderError, match="one of `racecraft train`; expected one of `racecraft gym train`"):
        run.read_job_of("gymnasium")
    run.write_job({"kind": "chess"})
    with pytest.raises(RunFolderError, match="of an unknown kind, 'chess'; expected one of `racecraft train`"):
        run.read_job_of("deepracer")


def test_a_training_is_asked_to_stop_until_that_is_forgotten(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    run.clear_stop()
    assert not run.stop_requested()
    run.request_stop()
    assert run.stop_requested()
    run.clear_stop()
    assert not run.stop_requested()


def test_who_holds_the_folder_trains_there(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    assert not run.is_training()
    with run.lock():
        assert run.is_training()
    assert not run.is_training()


def test_a_run_with_a_word_behind_its_colon_is_no_folder(tmp_path):
    RunFolder.create(tmp_path / "r")
    with pytest.raises(RunFolderError, match="r is a run, and nothing here is called 'bst'"):
        RunFolder.open(f"{tmp_path / 'r'}:bst")
    for none in ("q:best", "q"):
        with pytest.raises(RunFolderError, match="there is no such folder"):
            RunFolder.open(tmp_path / none)


def test_files_that_cannot_be_read_or_written_get_letters(tmp_path):
    run = RunFolder.create(tmp_path / "r")
    run.metrics.mkdir()
    with pytest.raises(RunFolderError, match=r"metrics\.jsonl: cannot be read \(Is a directory\)"):
        run.read_metrics()
    with pytest.raises(RunFolderError, match=r"metrics\.jsonl: cannot be written \(Is a directory\)"):
        run.append_metrics({"iteration": 0})
    run.job.write_bytes(b'"\xff"')
    with pytest.raises(RunFolderError, match=r"job\.json: cannot be read"):
        run.read_job()
    run.job.unlink()
    with pytest.raises(RunFolderError, match=r"job\.json: there is no such file"):
        run.read_job()
    with pytest.raises(TypeError, match="object cannot be written as JSON"):
        run.write_job({"a": object()})
