"""Rows made from folders and jobs: current, made again when lost, without opening what has not changed."""

import json
import os
import sqlite3
import threading
import time
from types import SimpleNamespace
from urllib.parse import parse_qsl, urlsplit

import pytest
import sqlalchemy as sql
from tests.console.conftest import write_run

from racecraft.console import index as index_module
from racecraft.console import paging
from racecraft.console.index import FILE, Index
from racecraft.console.index_tables import MODELS
from racecraft.console.pages import garage
from racecraft.console.run_row import read_run
from racecraft.console.workspace import Note, WorkspaceError
from racecraft.database.engine import DatabaseError
from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.job import new_job
from racecraft.jobs.states import State


def test_a_run_of_the_command_line_is_a_row(workspace, index):
    write_run(workspace.path / "runs/oval-1", track="Oval_track", lap=8.25)
    assert index.refresh() == ["oval-1"]
    row = index.row("oval-1")
    assert (row["status"], row["best_text"], row["iterations"], row["gap_percent"]) == ("ready", "8.25 s", 3, 12.0)
    assert row["curve"][-1] == 1.0


def test_an_imported_model_is_ready_though_it_never_trained_here(workspace, index):
    run = write_run(workspace.create("old", {}).path / "runs/1", rows=0)
    index.refresh()
    assert index.row("old")["status"] == "new"
    job = json.loads((run / "job.json").read_text())
    (run / "job.json").write_text(json.dumps({**job, "imported": {"from": "old.tar.gz"}}))
    index.refresh()
    assert index.row("old")["status"] == "ready"


def test_a_model_shows_its_newest_run_and_its_best_lap(workspace, index):
    model = workspace.create("car", {})
    write_run(model.path / "runs/1", lap=6.5)
    write_run(model.path / "runs/2", rows=5, lap=7.0)
    index.refresh()
    row = index.row("car")
    assert (row["iterations"], row["best_text"], row["runs"]) == (5, "6.50 s", 2)


def test_only_what_changed_is_read_again(workspace, index, monkeypatch):
    run = write_run(workspace.path / "runs/a")
    write_run(workspace.path / "runs/b")
    index.refresh()
    read = []
    monkeypatch.setattr(index_module, "read_run", lambda path, mark: read.append(path.name) or read_run(path, mark))
    assert index.refresh() == []
    assert read == []
    with open(run / "metrics.jsonl", "a") as file:
        file.write('{"iteration": 4, "steps": 9000, "seconds": 70.0}\n')
    assert index.refresh() == ["a"]
    assert read == ["a"]
    assert index.row("a")["iterations"] == 4


@pytest.mark.parametrize("harm", ["lost", "damaged", "older"])
def test_a_database_that_is_lost_is_made_again_from_the_folders(workspace, harm):
    write_run(workspace.path / "runs/a")
    first = Index(workspace)
    first.refresh()
    before = first.row("a")
    first.close()
    file = workspace.path / FILE
    if harm == "lost":
        file.unlink()
    elif harm == "damaged":
        file.write_bytes(b"no database at all" * 100)
    else:
        with sqlite3.connect(file) as base:
            base.execute("update console_about set value = '0' where name = 'version'")
        base.close()
    again = Index(workspace)
    again.refresh()
    assert again.row("a") == before
    again.close()


def test_a_full_disk_is_said_and_the_rows_are_made_once_there_is_space(workspace, index):
    write_run(workspace.path / "runs/a")
    index.refresh()
    with index._engine.connect() as connection:
        pages = connection.exec_driver_sql("pragma page_count").scalar()
        connection.exec_driver_sql(f"pragma max_page_count={pages}")
    note = workspace.model("a")
    note.write_note(Note(text="long " * 20_000))
    with pytest.raises(DatabaseError, match="disk is full"):
        index.refresh()
    assert index.row("a")["text"] == ""
    with index._engine.connect() as connection:
        connection.exec_driver_sql("pragma max_page_count=1000000")
    assert index.refresh() == ["a"]
    assert len(index.row("a")["text"]) == 100_000


@pytest.mark.parametrize("folder", ["models/car/runs/1", "runs/car"])
def test_a_run_folder_that_vanishes_keeps_its_row_and_a_sentence_and_comes_back(workspace, index, folder):
    if folder.startswith("models"):
        workspace.create("car", {})
    run = write_run(workspace.path / folder)
    index.refresh()
    run.rename(workspace.path / "elsewhere")
    assert index.refresh() == ["car"]
    assert index.refresh() == []
    assert (index.row("car")["status"], index.row("car")["best_text"]) == ("gone", "7.00 s")
    assert f"{run}: this folder is gone" in index.row("car")["reason"]
    (workspace.path / "elsewhere").rename(run)
    assert index.refresh() == ["car"]
    assert (index.row("car")["status"], index.row("car")["run"]) == ("ready", str(run))


def test_a_model_that_was_renamed_or_taken_off_the_list_is_no_row(workspace, index):
    write_run(workspace.path / "runs/a")
    index.refresh()
    workspace.rename(workspace.model("a"), "b")
    index.forget("a")
    assert sorted(index.refresh()) == ["a", "b"]
    assert [row["name"] for row in index.query(sql.select(MODELS))] == ["b"]


@pytest.mark.parametrize("jump_seconds", [-7200.0, 7200.0])
def test_a_clock_that_jumps_loses_no_change(workspace, index, monkeypatch, jump_seconds):
    run = write_run(workspace.path / "runs/a")
    index.refresh()
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now + jump_seconds)
    with open(run / "metrics.jsonl", "a") as file:
        file.write('{"iteration": 4, "steps": 9000, "seconds": 70.0}\n')
    os.utime(run / "metrics.jsonl", (now + jump_seconds, now + jump_seconds))
    assert index.refresh() == ["a"]
    assert index.row("a")["iterations"] == 4


def test_a_model_that_was_deleted_is_no_row(workspace, index):
    model = workspace.create("car", {})
    index.refresh()
    workspace.delete(model)
    assert index.refresh() == ["car"]
    with pytest.raises(WorkspaceError, match="no such model"):
        index.row("car")


def test_a_run_that_cannot_be_read_is_a_row_that_says_why(workspace, index):
    run = write_run(workspace.path / "runs/a")
    (run / "job.json").write_text("{")
    index.refresh()
    row = index.row("a")
    assert row["status"] == "error"
    assert "job.json" in row["reason"]


def test_a_job_that_waits_and_one_that_failed_show_in_their_model(workspace, index):
    model = workspace.create("car", {})
    spec = JobSpec(("train", "."), "car-1", run="runs/1", folder=str(model.path))
    waiting = new_job(spec, 1.0)
    index.refresh([waiting])
    assert (index.row("car")["status"], index.row("car")["job"]) == ("queued", "car-1")
    failed = waiting.claimed("me", 2.0).finished(State.FAILED, 3.0, "exit code 2: no such track")
    index.refresh([failed])
    assert (index.row("car")["status"], index.row("car")["reason"]) == ("error", "exit code 2: no such track")
    index.refresh([waiting.with_stop_requested(2.0, "stopped before it began")])
    assert (index.row("car")["status"], index.row("car")["reason"]) == ("new", "It was stopped before it began.")
    run, began = write_run(model.path / "runs/1", rows=0), waiting.claimed("me", 2.0)
    index.refresh([began])
    assert (index.row("car")["status"], index.row("car")["run"]) == ("training", str(run))
    index.refresh([began.moved(State.TRAINING, 2.5, "").finished(State.COMPLETED, 3.0, "")])
    assert (index.row("car")["status"], index.row("car")["reason"]) == ("new", "It ended before its first iteration.")
    assert index.row("car")["run"] == str(run), "its folder is there"


def test_rows_are_there_at_once_when_the_console_comes_back(workspace):
    write_run(workspace.path / "runs/a")
    first = Index(workspace)
    first.refresh()
    first.close()
    again = Index(workspace)
    assert again.is_filled
    assert again.row("a")["iterations"] == 3
    assert again.refresh() == [], "what did not change is not written again"
    again.close()


def test_a_row_that_changes_is_never_missing(workspace, index):
    run = write_run(workspace.path / "runs/a")
    index.refresh()
    missing, done = [], threading.Event()

    def read():
        while not done.is_set():
            try:
                index.row("a")
            except WorkspaceError as error:
                missing.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    for number in range(4, 40):
        with open(run / "metrics.jsonl", "a") as file:
            file.write(f'{{"iteration": {number}, "steps": 9000, "seconds": 70.0}}\n')
        assert index.refresh() == ["a"]
    done.set()
    reader.join()
    assert missing == []


@pytest.mark.parametrize("sort", ["changed", "name", "best"])
def test_pages_of_the_list_neither_repeat_nor_miss_a_model_while_others_come_and_go(
    workspace, index, monkeypatch, sort
):
    for number, lap in enumerate((7.0, 6.5, 7.0, None, 6.0)):
        write_run(workspace.path / f"runs/m{number}", lap=lap)
    index.refresh()
    monkeypatch.setattr(paging, "PAGE", 2)

    def page(**query):
        shown = garage._page_of(SimpleNamespace(index=index), sql.select(MODELS), sort, query)
        places = [dict(parse_qsl(urlsplit(address).query)) for address in (shown.before, shown.behind)]
        return [row["name"] for row in shown.rows], places[0].get("before", ""), places[1].get("after", "")

    first, nothing, behind = page()
    (workspace.path / f"runs/{first[0]}").rename(workspace.path / f"bin/{first[0]}.runs.1")
    index.refresh()
    second, before, further = page(after=behind)
    last, _, end = page(after=further)
    assert (nothing, end) == ("", "")
    assert sorted([*first, *second, *last]) == ["m0", "m1", "m2", "m3", "m4"]
    assert page(before=before)[0] == first[1:]
    assert page(after='["x", 3]')[0] == page()[0], "a place that is none"
    if sort == "best":
        assert [*first, *second, *last] == ["m4", "m1", "m0", "m2", "m3"]
