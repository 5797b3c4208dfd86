"""A workspace as one file: saved, brought back elsewhere, and by another Python."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import zipfile
from contextlib import closing
from pathlib import Path

import pytest
from tests.console.conftest import write_run

import racecraft
from racecraft.console.workspace import Note, Workspace
from racecraft.console.workspace_file import MANIFEST, restore_workspace, save_workspace
from racecraft.console.workspace_settings import WorkspaceSettings, write_settings
from racecraft.contract.errors import UserInputError
from racecraft.formats.archive import ArchiveError


@pytest.fixture
def full(workspace):
    """A workspace with a model, its run, a run of a command, a draft, driven laps, a search, a log and settings."""
    model = workspace.create("mint", {"reward_function.py": "def reward_function(params):\n    return 1.0\n"}, Note())
    write_run(model.path / "runs/1")
    write_run(workspace.path / "runs/oval-1")
    (model.path / "runs/1/run.lock").write_text("1")
    (workspace.path / "drafts/a.json").write_text("{}")
    (workspace.path / "driven").mkdir()
    (workspace.path / "driven/Oval_track.safetensors").write_bytes(bytes(range(256)) * 100)
    (workspace.path / "console.sqlite").write_text("index")
    write_run(workspace.path / "tunings/1/trials/0")
    with closing(sqlite3.connect(workspace.path / "tunings/1/study.sqlite")) as study:
        study.execute("create table trials (score real)")
    (workspace.path / "logs/race.csv").mkdir(parents=True)
    (workspace.path / "logs/race.csv/race.csv").write_text("iteration,episode\n")
    write_settings(workspace.path, WorkspaceSettings(notify=("desktop",)))
    return workspace


def files_of(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in ("run.lock", "console.sqlite")
    }


def test_a_workspace_comes_back_file_by_file(full, tmp_path):
    saved = save_workspace(full, tmp_path / "all.zip")
    there = Workspace.open(tmp_path / "elsewhere")
    restored = restore_workspace(saved.file, there)
    assert restored.models == ["mint", "oval-1"]
    assert files_of(there.path) == files_of(full.path)
    assert saved.files == len(files_of(full.path))


def test_what_is_left_out_is_named_and_can_be_saved_by_itself(full, tmp_path):
    assert save_workspace(full, tmp_path / "all.zip").left_out == []
    ada = Workspace.open(full.path / "people/Ada-1")
    ada.create("secret", {"reward_function.py": "x = 1\n"}, Note())
    (full.path / "league").mkdir()
    saved = save_workspace(full, tmp_path / "all.zip")
    assert saved.left_out == [str(ada.path), str(full.path / "league")]
    with zipfile.ZipFile(saved.file) as archive:
        assert not [name for name in archive.namelist() if "secret" in name]
    there = restore_workspace(save_workspace(ada, tmp_path / "ada.zip").file, Workspace.open(tmp_path / "elsewhere"))
    assert there.models == ["secret"]


def test_nothing_that_is_there_is_written_over(full, tmp_path):
    saved = save_workspace(full, tmp_path / "all.zip")
    before = files_of(full.path)
    restored = restore_workspace(saved.file, full)
    assert restored.models == ["mint-2", "oval-2"]
    assert restored.left_out == ["a.json", "Oval_track.safetensors", "settings.json"]
    assert (full.path / "tunings/2/trials/0/job.json").is_file()
    assert (full.path / "logs/2-race.csv/race.csv").is_file()
    assert files_of(full.path).items() >= before.items()


def test_a_search_that_writes_is_saved_as_of_one_moment(full, tmp_path):
    study = sqlite3.connect(full.path / "tunings/1/study.sqlite", isolation_level=None)
    with closing(study):
        study.execute("pragma journal_mode=wal")
        study.execute("insert into trials values (67.0)")
        study.execute("begin immediate")
        study.execute("insert into trials values (70.0)")
        saved = save_workspace(full, tmp_path / "all.zip")
    there = Workspace.open(tmp_path / "elsewhere")
    restore_workspace(saved.file, there)
    assert [path.name for path in (there.path / "tunings/1").iterdir() if path.is_file()] == ["study.sqlite"]
    with closing(sqlite3.connect(there.path / "tunings/1/study.sqlite")) as restored:
        assert restored.execute("select score from trials").fetchall() == [(67.0,)]


def test_a_file_that_lacks_something_is_refused_and_leaves_nothing(full, tmp_path):
    saved = save_workspace(full, tmp_path / "all.zip")
    with zipfile.ZipFile(saved.file) as whole, zipfile.ZipFile(tmp_path / "less.zip", "w") as less:
        for name in whole.namelist()[:-1]:
            less.writestr(name, whole.read(name))
    there = Workspace.open(tmp_path / "elsewhere")
    with pytest.raises(ArchiveError, match="as it says"):
        restore_workspace(tmp_path / "less.zip", there)
    assert files_of(there.path) == {}


@pytest.mark.parametrize("told", [None, {"format": "racecraft workspace", "version": 9, "files": 0}, {"format": "x"}])
def test_what_is_no_saved_workspace_is_refused(tmp_path, told):
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as other:
        other.writestr("models/a/x", "y")
        if told is not None:
            other.writestr(MANIFEST, json.dumps(told))
    with pytest.raises(UserInputError, match=r"other\.zip"):
        restore_workspace(tmp_path / "other.zip", Workspace.open(tmp_path / "elsewhere"))


def other_pythons():
    """Return interpreters of the other promised versions that are here."""
    places = [Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"]
    found = {}
    for version in ("3.11", "3.12", "3.13", "3.14"):
        here = [
            *(path for place in places for path in place.glob(f"{version}.*/bin/python")),
            shutil.which(f"python{version}"),
        ]
        if version != ".".join(map(str, sys.version_info[:2])) and (python := next(filter(None, here), None)):
            found[version] = str(python)
    return found


@pytest.mark.parametrize("version", sorted(other_pythons()))
def test_another_python_brings_it_back(full, tmp_path, version):
    """The code that saves and restores needs nothing but the standard library, so any promised Python can try it."""
    saved = save_workspace(full, tmp_path / "all.zip")
    script = (
        "import sys; from pathlib import Path\n"
        "from racecraft.console.workspace import Workspace\n"
        "from racecraft.console.workspace_file import restore_workspace, save_workspace\n"
        "there = Workspace.open(Path(sys.argv[2]))\n"
        "print(restore_workspace(Path(sys.argv[1]), there).models)\n"
        "save_workspace(there, Path(sys.argv[3]))\n"
    )
    there, back = tmp_path / "elsewhere", tmp_path / "back.zip"
    done = subprocess.run(
        [other_pythons()[version], "-S", "-c", script, saved.file, there, back],
        env={**os.environ, "PYTHONPATH": str(Path(racecraft.__file__).parents[1])}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.stdout.strip() == "['mint', 'oval-1']", done.stderr
    assert files_of(there) == files_of(full.path)
    assert json.loads(zipfile.ZipFile(back).read(MANIFEST))["python"].startswith(version)
    again = Workspace.open(tmp_path / "again")
    restore_workspace(back, again)
    assert files_of(again.path) == files_of(full.path)
