"""Every model of a workspace as a row, so that no page opens a run folder to list it. Begin with `Index.refresh`.

The rows are made from the folders and the jobs alone: a database that is gone or of another version is filled again.
One thread writes (`watcher.py`); any thread reads.
"""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import sqlalchemy as sql

from racecraft.console.index_tables import ABOUT, MODELS, RUNS, TABLES, VERSION
from racecraft.console.model_row import GONE, gone_row, model_row
from racecraft.console.run_row import RunRow, read_run, run_mark
from racecraft.console.workspace import MODEL_FILE, Model, Note, Workspace, WorkspaceError
from racecraft.contract.errors import nearest
from racecraft.database.engine import DatabaseError, database_errors, one_transaction, open_engine
from racecraft.formats.run_lock import holder
from racecraft.jobs.job import Job

FILE = "console.sqlite"
LIVELY_SECONDS = 120.0
"""A run that changed so recently is looked at closely."""


class Index:
    """The rows of a workspace.

    Args:
        workspace: What they are of.
        url: Address of the database; None: a SQLite file in the workspace.

    Raises:
        DatabaseError: It cannot be opened or written.
    """

    def __init__(self, workspace: Workspace, url: str | None = None) -> None:
        self.workspace = workspace
        self.url = url or f"sqlite:///{workspace.path / FILE}"
        self.version = 0
        """Counts the changes that `refresh` found."""
        self._engine = self._opened()
        self._runs = {row.path: row for row in self._kept_runs()}
        self._rows = {row["name"]: row for row in self.query(sql.select(MODELS))}
        self._folder_marks: dict[str, int] = {}
        self._lists: dict[str, tuple[int, list[str]]] = {}
        self._seen_to_change: dict[str, float] = {}
        self._training: set[str] = set()
        self._notes: dict[Path, tuple[int, Note]] = {}
        self._forgotten: set[str] = set()

    def close(self) -> None:
        """Let go of the database."""
        self._engine.dispose()

    def refresh(self, jobs: Iterable[Job] = ()) -> list[str]:
        """Make the rows what the folders and jobs are; return the names of the models whose rows changed.

        Raises:
            DatabaseError: The database cannot be written.
        """
        by_folder = _jobs_by_model(jobs)
        rows: dict[str, dict[str, Any]] = {}
        runs: dict[str, RunRow] = {}
        for model in self.workspace.models():
            found = [self._run(path) for path in self._run_paths(model)]
            runs |= {row.path: row for row in found}
            rows[model.name] = model_row(
                model, self._note(model), found, by_folder.get(str(model.path), []), self._training.__contains__
            )
        rows |= self._gone_rows(rows)
        changed = [name for name, row in rows.items() if self._rows.get(name) != row]
        gone = [name for name in self._rows if name not in rows]
        if changed or gone:
            self._write(rows, runs, changed, gone)
        self._rows, self._runs = rows, runs
        return [*changed, *gone]

    def forget(self, name: str) -> None:
        """Have the next `refresh` drop the row of a model whose folder got another name, or is gone for good."""
        self._forgotten.add(name)

    def _gone_rows(self, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
        """Return the rows of models whose runs vanished, neither deleted nor renamed by the console."""
        lost = {name: row for name, row in self._rows.items() if row["run"] or row["status"] == GONE}
        lost = {name: row for name, row in lost.items() if name not in rows or not rows[name]["run"]}
        if not lost:
            return {}
        left_out = {name for _, name, _ in self.workspace.bin()} | self._forgotten
        self._forgotten = set()
        return {name: gone_row(row) for name, row in lost.items() if name not in left_out}

    @property
    def is_filled(self) -> bool:
        """Whether there are rows, if only those of the last time."""
        return bool(self._rows)

    def row(self, name: str) -> dict[str, Any]:
        """Return a model's row.

        Raises:
            WorkspaceError: There is no such model.
        """
        with self._connected() as connection:
            found = connection.execute(sql.select(MODELS).where(MODELS.c.name == name)).mappings().first()
            if found is None:
                names = connection.execute(sql.select(MODELS.c.name)).scalars().all()
                raise WorkspaceError(
                    "{name}: there is no such model. {hint}", name=name[:80], hint=nearest(name[:80], names)
                )
        return dict(found)

    def query(self, statement: sql.Select[Any]) -> list[dict[str, Any]]:
        """Return the rows of a statement over the tables of `index_tables`."""
        with self._connected() as connection:
            return [dict(row) for row in connection.execute(statement).mappings()]

    def _run_paths(self, model: Model) -> list[str]:
        """Return a model's run folders; they are listed again where one came or went, or has not begun yet."""
        folder = str(model.path if model.is_run else model.path / "runs")
        mark = _changed_at(folder)
        kept = self._lists.get(folder)
        if kept is None or kept[0] != mark:
            found = [str(path) for path in model.runs()]
            whole = model.is_run or len(found) == _count_folders(folder)
            kept = self._lists[folder] = (mark if whole else -1, found)
        return kept[1]

    def _run(self, name: str) -> RunRow:
        """Return a run's row; it is read only where its files changed.

        Of a run that rests the folder's own time is enough: whoever goes on with it writes job.json anew.
        """
        held, mark = self._runs.get(name), _changed_at(name)
        quiet_seconds = time.monotonic() - self._seen_to_change.get(name, -math.inf)
        rests = held is not None and quiet_seconds > LIVELY_SECONDS and name not in self._training
        if held is not None and rests and self._folder_marks.get(name) == mark:
            return held
        path = Path(name)
        self._folder_marks[name] = mark
        if _is_held(name):
            self._training.add(name)
        else:
            self._training.discard(name)
        files = run_mark(path)
        if held is not None and held.mark == files:
            return held
        self._seen_to_change[name] = time.monotonic()  # the system's clock may jump
        return read_run(path, files)

    def _note(self, model: Model) -> Note:
        mark = _changed_at(f"{model.path}/{MODEL_FILE}")
        kept = self._notes.get(model.path)
        if kept is None or kept[0] != mark:
            kept = self._notes[model.path] = (mark, model.note())
        return kept[1]

    def _write(
        self, rows: Mapping[str, Mapping[str, Any]], runs: Mapping[str, RunRow], changed: list[str], gone: list[str]
    ) -> None:
        old = [path for path in self._runs if path not in runs]
        new = [row for path, row in runs.items() if self._runs.get(path) != row]
        with self._connected() as connection, one_transaction(connection):
            for some in _some([*changed, *gone]):
                connection.execute(MODELS.delete().where(MODELS.c.name.in_(some)))
            for some in _some([*old, *(row.path for row in new)]):
                connection.execute(RUNS.delete().where(RUNS.c.path.in_(some)))
            for these in _some([dict(rows[name]) for name in changed]):
                connection.execute(MODELS.insert(), these)
            for those in _some([{"path": row.path, "row": asdict(row)} for row in new]):
                connection.execute(RUNS.insert(), those)
        self.version += 1

    def _kept_runs(self) -> list[RunRow]:
        with self._connected() as connection:
            rows = connection.execute(sql.select(RUNS.c.row)).scalars().all()
        with contextlib.suppress(TypeError):
            return [RunRow(**{**row, "curve": tuple(row["curve"]), "stops": tuple(row["stops"])}) for row in rows]
        return []

    def _opened(self) -> sql.Engine:
        """Open the database; one that is damaged, of another version or workspace is emptied."""
        try:
            return self._with_tables(open_engine(self.url))
        except DatabaseError:
            file = self.workspace.path / FILE
            if self.url != f"sqlite:///{file}" or not file.is_file():
                raise
            file.rename(file.with_suffix(f".damaged-{int(time.time())}"))  # the folders hold all that was in it
            return self._with_tables(open_engine(self.url))

    def _with_tables(self, engine: sql.Engine) -> sql.Engine:
        try:
            self._make_tables(engine)
        except BaseException:
            engine.dispose()
            raise
        return engine

    def _make_tables(self, engine: sql.Engine) -> None:
        about = {"version": str(VERSION), "workspace": str(self.workspace.path)}
        with database_errors(self.url), engine.connect() as connection:
            if engine.dialect.name == "sqlite":
                connection.exec_driver_sql("pragma journal_mode=wal")
                connection.exec_driver_sql("pragma synchronous=off")  # what a crash loses is made again
            ABOUT.create(connection, checkfirst=True)
            kept = {row.name: row.value for row in connection.execute(sql.select(ABOUT))}
            if kept != about:
                TABLES.drop_all(connection)
                TABLES.create_all(connection)
                connection.execute(ABOUT.insert(), [{"name": name, "value": value} for name, value in about.items()])

    @contextlib.contextmanager
    def _connected(self) -> Any:
        with database_errors(self.url), self._engine.connect() as connection:
            yield connection


def _jobs_by_model(jobs: Iterable[Job]) -> dict[str, list[Job]]:
    """Return the jobs that train into a model's folder, the oldest first, by that folder."""
    found: dict[str, list[Job]] = {}
    for job in sorted(jobs, key=lambda job: job.created):
        run = job.spec.run_folder()
        if run is not None:
            run = Path(run.absolute())
            for folder in (run, run.parent.parent):
                found.setdefault(str(folder), []).append(job)
    return found


def _is_held(run: str) -> bool:
    """Tell whether a process of this machine trains in a run folder."""
    return holder(Path(run)) is not None


def _changed_at(path: str) -> int:
    """Return when a file or folder last changed, ns since 1970; 0 where it is gone."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0


def _count_folders(path: str) -> int:
    try:
        with os.scandir(path) as entries:
            return sum(entry.is_dir() for entry in entries)
    except OSError:
        return 0


def _some(these: list[Any], most: int = 500) -> Iterable[list[Any]]:
    """Yield a list in parts that a statement can carry."""
    for first in range(0, len(these), most):
        yield these[first : first + most]
