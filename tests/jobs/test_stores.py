"""What a store of jobs promises."""

import json
import sqlite3
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from tests.jobs.makers import python, wait_until

from racecraft.database.engine import DatabaseError
from racecraft.database.migrate import HEAD
from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.job import new_job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.sql_store import SqlStore
from racecraft.jobs.states import JobError
from racecraft.jobs.store import NameTakenError, change, get


def opened(path):
    return SqlStore(f"sqlite:///{path}")


@pytest.fixture
def store(tmp_path):
    made = opened(tmp_path / "jobs.sqlite")
    yield made
    made.close()


def job(name="a-1", created=1.0, **more):
    return new_job(JobSpec(("gym", "train"), name, **more), created)


def test_what_was_added_is_found_as_it_was(store):
    told = job(environment={"A": "b"}, metric_definitions=({"Name": "n", "Regex": "r"},), cores=2, recorded={"x": [1]})
    store.add(told)
    assert store.find("a-1") == told
    assert store.find("a-2") is None


def test_no_two_jobs_have_one_name(store):
    store.add(job())
    with pytest.raises(NameTakenError, match="jobs delete a-1"):
        store.add(job(created=2.0))
    assert [one.created for one in store.jobs()] == [1.0]


def test_a_change_of_what_stood_is_refused(store):
    store.add(job())
    held = store.find("a-1")
    assert store.replace(held, held.claimed("me", 2.0))
    assert not store.replace(held, held.claimed("you", 2.0))
    assert store.find("a-1").owner == "me"


def test_what_is_gone_is_neither_changed_nor_removed_again(store):
    store.add(job())
    held = store.find("a-1")
    assert store.remove(held)
    assert not store.remove(held)
    assert not store.replace(held, held.claimed("me", 2.0))
    assert store.jobs() == []


def test_what_has_changed_is_not_removed(store):
    store.add(job())
    held = store.find("a-1")
    store.replace(held, held.claimed("me", 2.0))
    assert not store.remove(held)
    assert store.find("a-1") is not None


def test_of_many_changes_at_once_none_is_lost(store):
    store.add(job())

    def count():
        for _ in range(25):
            change(store, "a-1", lambda held: replace(held, attempts=held.attempts + 1))

    threads = [threading.Thread(target=count) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.find("a-1").attempts == 100


def test_an_unknown_name_is_told_the_nearest(store):
    with pytest.raises(JobError, match="none yet"):
        get(store, "gym-1")
    store.add(job("gym-1"))
    with pytest.raises(JobError, match="Did you mean 'gym-1'"):
        get(store, "gmy-1")


CLAIM = """
import sys, time
from pathlib import Path
from racecraft.jobs.sql_store import SqlStore
path, owner, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
store = SqlStore(f"sqlite:///{path}")
seen = store.jobs()
(folder / owner).touch()
while not (folder / "go").exists():
    time.sleep(0.001)
print(*[held.name for held in seen if store.replace(held, held.claimed(owner, 2.0))])
"""


def test_of_several_processes_that_claim_at_once_one_gets_it(tmp_path):
    """All have seen all jobs waiting before the first of them claims one."""
    path = tmp_path / "jobs.sqlite"
    store = opened(path)
    names = [f"j-{number}" for number in range(40)]
    for name in names:
        store.add(job(name))
    owners = ("p0", "p1", "p2")
    claimers = [python(CLAIM, path, owner, tmp_path, stdout=subprocess.PIPE, text=True) for owner in owners]
    wait_until(lambda: all((tmp_path / owner).exists() for owner in owners))
    (tmp_path / "go").touch()
    told = {owner: one.communicate(timeout=60)[0].split() for owner, one in zip(owners, claimers, strict=True)}
    assert sorted(name for got in told.values() for name in got) == sorted(names)
    assert {one.name: one.owner for one in store.jobs()} == {name: owner for owner in owners for name in told[owner]}
    store.close()


def test_a_store_survives_the_process(tmp_path):
    path = tmp_path / "jobs.sqlite"
    python(
        "import sys; from racecraft.jobs.job_paths import JobPaths; from racecraft.jobs.job import new_job;"
        "from racecraft.formats.job_spec import JobSpec; import os, signal; from pathlib import Path;"
        "store = JobPaths(Path(sys.argv[1]).parent, 'sqlite:///' + sys.argv[1]).store();"
        "store.add(new_job(JobSpec(('gym',), 'kept'), 1.0)); os.kill(os.getpid(), signal.SIGKILL)",
        path,
    ).wait()
    store = opened(path)
    assert store.find("kept") is not None
    store.close()


V0 = """
create table racecraft_store (name varchar(32) primary key, value varchar(255) not null);
insert into racecraft_store values ('version', '1');
create table racecraft_jobs (name varchar(63) not null, created float not null, state varchar(32) not null,
    revision integer not null, told text not null, primary key (name));
create index ix_racecraft_jobs_created on racecraft_jobs (created);
"""


def test_a_database_from_before_the_migrations_keeps_its_jobs(tmp_path):
    path, old = tmp_path / "jobs.sqlite", job("old")
    with sqlite3.connect(path) as base:
        base.executescript(V0)
        told = json.dumps(old.as_dictionary())
        base.execute("insert into racecraft_jobs values ('old', 1.0, 'Pending', 0, ?)", (told,))
    base.close()
    store = opened(path)
    assert store.jobs() == [old]
    store.add(job("new", 2.0))
    with sqlite3.connect(path) as base:
        assert base.execute("select name, person from racecraft_jobs").fetchall() == [("old", ""), ("new", "")]
        assert base.execute("select version_num from alembic_version").fetchall() == [(HEAD,)]
    base.close()
    store.close()


def test_many_that_open_a_new_database_at_once_all_can(tmp_path):
    with ThreadPoolExecutor(6) as pool:
        stores = list(pool.map(opened, [tmp_path / "jobs.sqlite"] * 6))
    stores[0].add(job())
    assert [[one.name for one in store.jobs()] for store in stores] == [["a-1"]] * 6
    for store in stores:
        store.close()


def test_a_database_of_a_newer_version_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "jobs.sqlite"
    opened(path).close()
    with sqlite3.connect(path) as base:
        base.execute("update alembic_version set version_num = '9999'")
    base.close()
    before = path.read_bytes()
    with pytest.raises(DatabaseError, match="version 9999; expected .*RACECRAFT_JOB_STORE"):
        opened(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("url", "letter"),
    [
        ("nonsense", "no address of a database"),
        ("ducks://here/jobs", "knows no such database"),
    ],
)
def test_an_address_that_cannot_be_used_is_said(url, letter):
    with pytest.raises(DatabaseError, match=letter):
        SqlStore(url)


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(DatabaseError, match="sqlite:////proc/jobs.sqlite: cannot be written"):
        JobPaths(tmp_path, "sqlite:////proc/jobs.sqlite").store()
    (tmp_path / "file").touch()
    with pytest.raises(DatabaseError, match="file/jobs.sqlite"):
        JobPaths(tmp_path, f"sqlite:///{tmp_path}/file/jobs.sqlite").store()


def test_a_file_that_is_no_database_is_said_and_left_alone(tmp_path):
    path = tmp_path / "jobs.sqlite"
    path.write_text("these are my notes, no database at all\n" * 100)
    with pytest.raises(DatabaseError, match="no database of racecraft"):
        opened(path)
    assert "my notes" in path.read_text()


def add_many(store):
    for number in range(200):
        store.add(job(f"more-{number}", recorded={"much": "x" * 4000}))


def test_a_full_disk_is_said_and_loses_nothing(tmp_path, monkeypatch):
    """SQLite's own limit of pages stands for the disk: it answers as on a full one."""
    store = opened(tmp_path / "jobs.sqlite")
    store.add(job("kept"))
    connect = sqlite3.connect

    def with_no_room(*arguments, **more):
        connection = connect(*arguments, **more)
        connection.execute("pragma max_page_count = 1")
        return connection

    monkeypatch.setattr(sqlite3, "connect", with_no_room)
    monkeypatch.setattr(sqlite3.dbapi2, "connect", with_no_room)
    store.close()  # the next connection finds no room
    with pytest.raises(DatabaseError, match="the disk is full .* nothing was changed"):
        add_many(store)
    assert store.find("kept") == job("kept")
    held = store.find("kept")
    assert store.replace(held, held.claimed("me", 2.0)), "what fits is still taken"
    store.close()
