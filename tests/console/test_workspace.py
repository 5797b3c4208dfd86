"""Models as folders: found, made, renamed, deleted and restored."""

import errno
import os
import stat
import subprocess
import sys

import pytest

from racecraft.console.workspace import BIN, BIN_SECONDS, Note, Workspace, WorkspaceError
from racecraft.formats.atomic import OutputFileError


@pytest.fixture
def workspace(tmp_path):
    return Workspace.open(tmp_path)


def test_a_model_is_found_by_the_name_of_its_folder(workspace):
    made = workspace.create("mint 7", {"reward_function.py": "x = 1\n"}, Note(tags=("race",)))
    found = workspace.model("mint 7")
    assert found == made
    assert found.note().tags == ("race",)
    assert (found.path / "reward_function.py").read_text() == "x = 1\n"


def test_runs_of_the_command_line_are_models_and_numbered_runs_are_in_order(workspace):
    (workspace.path / "runs/alone").mkdir(parents=True)
    (workspace.path / "runs/alone/job.json").write_text("{}")
    (workspace.path / "runs/no-run").mkdir()
    model = workspace.create("many", {})
    for number in (1, 2, 10):
        (model.path / f"runs/{number}").mkdir(parents=True)
        (model.path / f"runs/{number}/job.json").write_text("{}")
    assert [one.name for one in workspace.models()] == ["many", "alone"]
    assert [run.name for run in model.runs()] == ["1", "2", "10"]
    assert model.next_run() == "runs/11"


@pytest.mark.parametrize("name", ["", "..", "a/b", "../x", "<b>", "a" * 65, ".hidden", "a\n", "x" + chr(0)])
def test_a_name_that_leads_elsewhere_is_refused(workspace, name):
    with pytest.raises(WorkspaceError):
        workspace.create(name, {})
    assert workspace.find(name) is None


def test_a_disk_that_fills_leaves_no_half_of_a_model(workspace, monkeypatch):
    real, left = os.fsync, iter((True, False))

    def fsync(handle):
        if not stat.S_ISDIR(os.fstat(handle).st_mode) and not next(left):
            raise OSError(errno.ENOSPC, "No space left on device")
        real(handle)

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(OutputFileError, match="disk is full"):
        workspace.create("car", {"reward_function.py": "x = 1\n", "model_metadata.json": "{}"})
    assert list(workspace.models()) == []


def test_a_taken_name_is_refused_with_a_free_one(workspace):
    workspace.create("car", {})
    with pytest.raises(WorkspaceError, match="such as car-2"):
        workspace.create("car", {})


def test_what_was_deleted_can_be_restored(workspace):
    model = workspace.create("car", {"reward_function.py": "x = 1\n"})
    place = workspace.delete(model)
    assert workspace.find("car") is None
    assert [name for _, name, _ in workspace.bin()] == ["car"]
    assert workspace.restore(place) == model
    assert (model.path / "reward_function.py").is_file()


def test_the_bin_is_emptied_after_its_time(workspace):
    workspace.delete(workspace.create("young", {}))
    old = workspace.path / BIN / "old.models.1"
    old.mkdir()
    again = Workspace.open(workspace.path)
    assert [name for _, name, _ in again.bin()] == ["young"]
    assert BIN_SECONDS > 0


def test_nothing_outside_the_bin_is_restored(workspace):
    with pytest.raises(WorkspaceError):
        workspace.restore("../models")


def test_a_damaged_note_says_nothing_and_loses_no_model(workspace):
    model = workspace.create("car", {})
    (model.path / "model.json").write_text("{")
    assert workspace.model("car").note() == Note()


def test_a_console_opens_without_pytorch(tmp_path):
    """Its first page waits for none of it: half of the time that the command would take."""
    code = (
        "import sys; from pathlib import Path; from racecraft.console.application import make_console\n"
        "from racecraft.jobs.job_paths import JobPaths\n"
        "make_console(Path('here'), JobPaths(Path('jobs'), 'sqlite:///jobs.sqlite')); print('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
