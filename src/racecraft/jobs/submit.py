"""Put a job into the store, and see to it that somebody works there. Begin with `submit`."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable
from dataclasses import replace

from racecraft.contract.loading import CONFINED, refuses_own_code
from racecraft.formats.atomic import make_folder
from racecraft.formats.job_spec import JobSpec, require_legal_name, write_job_spec
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.children import has_begun
from racecraft.jobs.job import Job, new_job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.preload import withdraw
from racecraft.jobs.states import JobError
from racecraft.jobs.store import JobStore, NameTakenError, change, get, name_taken
from racecraft.jobs.supervisor_start import ensure_supervisor, is_supervised
from racecraft.training.stopping import parse_stops

SENT_VARIABLES = ("PYTHONPATH", "OMP_NUM_THREADS", "CUDA_VISIBLE_DEVICES")
"""Variables that a job takes along from where it was begun, beside those named RACECRAFT_… and DR_…"""
LOOK_SECONDS = 0.2
LOOK_AGAIN_SECONDS = 5.0
"""How often one who waits looks whether a supervisor has been killed, and for how long a job is thought to be next."""


def submit(home: JobPaths, spec: JobSpec) -> Job:
    """Put a job into the store; a supervisor on this machine is started where there is none.

    Raises:
        NameTakenError: There is a job of that name.
        JobError: This machine could never start it, or it may wait for less time than it may run.
        DatabaseError: The store cannot be opened or written.
    """
    require_legal_name(spec.name)
    _require_time_to_run(spec)
    if not home.is_shared:
        Capacity.of_machine().require(spec)
    store = home.store()
    store.add(new_job(spec, time.time()))
    make_folder(home.folder(spec.name))
    write_job_spec(home.spec(spec.name), spec)
    ensure_supervisor(home)
    withdraw(home)
    return get(store, spec.name)


def require_free(home: JobPaths, name: str) -> None:
    """Raise NameTakenError where there is a job of that name, before anything is laid into its folder."""
    store = home.store()
    try:
        if store.find(name) is not None:
            raise name_taken(name)
    finally:
        store.close()


def _require_time_to_run(spec: JobSpec) -> None:
    run, wait = spec.max_run_seconds, spec.max_wait_seconds
    if run is not None and wait is not None and wait < run:
        raise JobError(
            "Job {name} may run for {run} s and must be over {wait} s from now; expected at least as much to "
            "wait as to run, for the time that it runs counts, too.",
            name=spec.name,
            run=run,
            wait=wait,
        )


def submit_numbered(home: JobPaths, base: str, spec: Callable[[str], JobSpec | None]) -> Job:
    """Put a job into the store under the next free `<base>-<number>`.

    Args:
        home: Where it is put.
        base: What its name begins with.
        spec: Makes the job of a name; None: the name does not do.
    """
    store = home.store()
    for number in itertools.count(1):
        name = f"{base}-{number}"
        if store.find(name) is None and (made := spec(name)) is not None:
            try:
                return submit(home, made)
            except NameTakenError:
                continue  # somebody was quicker
    raise AssertionError("numbers do not end")


def environment_here() -> dict[str, str]:
    """Return the variables that a job takes along from where it is begun."""
    here = {
        name: value
        for name, value in os.environ.items()
        if name in SENT_VARIABLES or name.startswith(("RACECRAFT_", "DR_"))
    }
    return {**here, **CONFINED} if refuses_own_code.get() else here


def request_stop(home: JobPaths, store: JobStore, name: str) -> Job:
    """Ask a job to end; what it has learned until then stays, and it can go on later."""

    def stopped(job: Job) -> Job:
        return job.with_stop_requested(time.time(), "stopped before it began" if job.waits else "stop requested")

    job = change(store, name, stopped)
    if not job.ended:
        ensure_supervisor(home)
    return job


def resume(home: JobPaths, store: JobStore, name: str, stops: tuple[str, ...] = ()) -> Job:
    """Have a job that has ended go on from where its run folder stands.

    Args:
        home: Where it lies.
        store: Where it is held.
        name: Which one.
        stops: New stop conditions for its training; none: those it has.

    Raises:
        SettingError: One of them is none.
        JobError: It has not ended, or new stops are given and it has no training to go on with.
    """
    parse_stops(stops)

    def again(job: Job) -> Job:
        spec = job.spec
        if stops and not spec.resume:
            raise JobError(
                "Job {name} is no training of racecraft's, so it has no --stop; resume it without.", name=name
            )
        if stops:
            kept = tuple(word for word in spec.resume if not word.startswith("--stop="))
            spec = replace(spec, resume=(*kept, *(f"--stop={stop}" for stop in stops)))
        return job.resumed(time.time(), spec)

    job = change(store, name, again)
    ensure_supervisor(home)
    return job


def wait(home: JobPaths, store: JobStore, name: str, seconds: float | None = None) -> Job:
    """Wait until a job has ended; return it.

    Raises:
        JobError: There is no such job, or it has not ended after so many seconds.
    """
    until = None if seconds is None else time.monotonic() + seconds
    looked = 0.0
    while not (job := get(store, name)).ended:
        if until is not None and time.monotonic() > until:
            raise JobError(
                "Job {name} is {state} after {seconds:g} s; expected its end. It goes on.",
                name=name,
                state=job.state,
                seconds=seconds,
            )
        if time.monotonic() - looked > LOOK_AGAIN_SECONDS:  # a supervisor may have been killed
            ensure_supervisor(home)
            looked = time.monotonic()
        time.sleep(LOOK_SECONDS)
    return job


def wait_for_run(home: JobPaths, store: JobStore, name: str) -> Job:
    """Wait until a job's run folder stands, it has ended, or it waits behind others; return it."""
    looked = time.monotonic()
    while not (job := get(store, name)).ended and not has_begun(job.spec):
        if time.monotonic() - looked > LOOK_AGAIN_SECONDS:
            if job.waits and is_supervised(home):
                return job
            ensure_supervisor(home)
            looked = time.monotonic()
        time.sleep(LOOK_SECONDS / 4)
    return job


def delete(home: JobPaths, store: JobStore, name: str) -> None:
    """Take a job and its log away; its run folder stays.

    Raises:
        JobError: It has not ended.
    """
    job = get(store, name)
    if not job.ended or not store.remove(job):
        raise JobError(
            "Job {name} is {state}; expected one that has ended. `racecraft jobs stop {name}` ends it.",
            name=name,
            state=job.state,
        )
    home.delete(name)
