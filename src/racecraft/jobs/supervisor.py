"""Works at the jobs of a store, until there is nothing left to do. Begin with `Supervisor.turn`.

One supervisor works on a machine for an account (a lock in the jobs' folder sees to it); many may share a store. It
outlives the terminal it was started from. When it dies its jobs die with it (`parent_watch.py`), and the next one takes
them up where their run folders stand: on the same machine at once, elsewhere when they have been silent for a while.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from racecraft.contract.errors import RacecraftError, RunFolderError
from racecraft.formats.atomic import make_folder
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_folder import METRICS, RunFolder
from racecraft.formats.run_lock import RunLock
from racecraft.jobs import children
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.children import Child
from racecraft.jobs.follow import last_words
from racecraft.jobs.job import Job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.preload import PreloadedProcess, is_awaited, is_kept_warm
from racecraft.jobs.states import JobError, State
from racecraft.jobs.store import JobStore, change

TURN_SECONDS = 0.2
TURN_SECONDS_AWAITED = 0.02
"""While a process waits for a job that was announced."""
WARM_AFTER_SECONDS = 60.0
"""A new warm worker begins to import when nothing is worked at or the training that took the last one is so old: to be
ready takes seconds of a core, and that training's first lap comes first."""
BEAT_SECONDS = 5.0
LOST_SECONDS = 60.0
"""A job whose owner, on another machine, was silent for so long is taken up by whoever notices."""
GRACE_SECONDS = 120.0
"""What a job is given to end by itself once it was asked to, as at SageMaker."""
IDLE_SECONDS = 20.0
"""A supervisor without work goes home after so long."""
LOCK_PATIENCE_SECONDS = 2.0
SIGKILL = 9


@dataclass
class Work:
    """A job that this supervisor works at."""

    child: Child
    spec: JobSpec
    progress: float
    """How new what it left on the disk was when it was started; see `progress_mark`."""
    asked_at: float | None = None
    """When it was asked to end."""
    makes_room: bool = False
    """Whether it was ended for a job that goes before it."""


class Supervisor:
    """Works at the jobs of a store.

    Args:
        store: Where they are held.
        home: Where their logs lie.
        name: What it calls itself; no two live at once under one name.
        capacity: What it may share out; None: what this machine has.
        grace_seconds: What a job is given to end by itself.
        lost_seconds: How long an owner elsewhere may be silent.
        clock: Tells the time, seconds since 1970.
        spare: A process that waits for its job already.
    """

    def __init__(
        self,
        store: JobStore,
        home: JobPaths,
        name: str = "",
        capacity: Capacity | None = None,
        grace_seconds: float = GRACE_SECONDS,
        lost_seconds: float = LOST_SECONDS,
        clock: Callable[[], float] = time.time,
        spare: PreloadedProcess | None = None,
    ) -> None:
        self._store, self._home, self._name = store, home, name or home.supervisor
        self._capacity = capacity or Capacity.of_machine()
        self._grace, self._lost, self._clock = grace_seconds, lost_seconds, clock
        self._spare = spare
        self._took_spare = -WARM_AFTER_SECONDS
        self._work: dict[str, Work] = {}

    @property
    def turn_seconds(self) -> float:
        """How long until it looks again."""
        return TURN_SECONDS if self._spare is None or self._spare.warm else TURN_SECONDS_AWAITED

    @property
    def busy(self) -> bool:
        """Whether it works at a job."""
        return bool(self._work)

    def reconcile(self) -> bool:
        """Do once whatever is due; tell whether there is anything left to do."""
        self._note_log_times()
        self._record_ended()
        awaited = is_awaited(self._home)  # asked before the store: an announced job is there when it is taken back
        warm = is_kept_warm(self._home)
        jobs = self._store.open_jobs()
        self._heed_limits(jobs)
        self._drop_lost(jobs)
        jobs = self._store.open_jobs()
        self._heed_stops(jobs)
        self._recover_orphans(jobs)
        self._start_waiting([job for job in jobs if job.waits])
        self._have_ready(awaited, warm)
        self._beat(jobs)
        return self.busy or warm or bool(jobs)

    def close(self) -> None:
        """End what it works at; whoever comes next goes on with it."""
        if self._spare is not None:
            self._spare.dismiss()
        for name, work in self._work.items():
            work.child.end()
            self._change(name, lambda job: job.interrupted(self._clock(), "its supervisor ended", progressed=True))
        self._work.clear()

    def _record_ended(self) -> None:
        """Say of each process that has ended what became of its job."""
        for name, work in list(self._work.items()):
            code = work.child.ended()
            if code is not None:
                self._change(name, lambda job, code=code, work=work: self._after(job, work, code))  # type: ignore[misc]
                self._note_log_time(name)
                del self._work[name]

    def _after(self, job: Job, work: Work, code: int) -> Job:
        now = self._clock()
        if job.state is State.STOPPING:
            return job.finished(job.ending or State.STOPPED, now, job.reason)
        if work.makes_room:
            return job.interrupted(now, "made room for a job that goes before it", progressed=True)
        if code == 0:
            return job.finished(State.COMPLETED, now)
        if 128 - code in (-signal.SIGTERM, -SIGKILL):  # as a shell tells it, or a script that was heard out
            code = 128 - code
        if code < 0:
            progressed = progress_mark(self._home, work.spec) > work.progress
            return job.interrupted(now, f"ended by {children.signal_name(code)}", progressed)
        message = last_words(self._home.log(job.name))
        return job.finished(State.FAILED, now, f"exit code {code}: {message}" if message else f"exit code {code}")

    def _heed_limits(self, jobs: list[Job]) -> None:
        """Ask jobs to end whose time is over."""
        now = self._clock()
        for job in jobs:
            spec, mine = job.spec, job.name in self._work
            if job.ended or job.state is State.STOPPING or not (mine or job.waits):
                continue
            if spec.max_wait_seconds is not None and now - job.transitions[0].time > spec.max_wait_seconds:
                why, ending = f"{spec.max_wait_seconds} s to wait are over", State.MAX_WAIT_TIME_EXCEEDED
            elif mine and spec.max_run_seconds is not None and job.training_seconds(now) > spec.max_run_seconds:
                why, ending = f"{spec.max_run_seconds} s to train are over", State.MAX_RUNTIME_EXCEEDED
            else:
                continue
            self._change(job.name, lambda job, why=why, ending=ending: job.with_stop_requested(now, why, ending))  # type: ignore[misc]

    def _heed_stops(self, jobs: list[Job]) -> None:
        """Pass on to processes that they are asked to end; end those that do not."""
        now = time.monotonic()
        for job in jobs:
            work = self._work.get(job.name)
            if work is None or not (job.state is State.STOPPING or work.makes_room):
                continue
            if work.asked_at is None:
                work.asked_at = now
                if not (job.state is State.STOPPING and _request_stop_in_run(work.spec)):
                    work.child.ask_to_end()
            elif now - work.asked_at > self._grace:
                work.child.kill()

    def _drop_lost(self, jobs: list[Job]) -> None:
        """End processes whose job is no longer ours: somebody thought us dead and has taken it up, or it is gone."""
        held = {job.name: job for job in jobs}
        for name, work in list(self._work.items()):
            if name not in held or held[name].owner != self._name:
                work.child.end()
                del self._work[name]

    def _recover_orphans(self, jobs: list[Job]) -> None:
        """Have jobs wait again whose owner is gone."""
        now = self._clock()
        for job in jobs:
            gone = job.worked_at and job.name not in self._work
            if gone and (job.owner == self._name or now - job.beat > self._lost):
                why = f"lost with its supervisor {job.owner}"
                with contextlib.suppress(JobError):
                    change(self._store, job.name, lambda held, job=job, why=why: _given_up(held, job, now, why))  # type: ignore[misc]

    def _start_waiting(self, waiting: list[Job]) -> None:
        """Start what fits, the oldest first, and nobody overtakes: else a job that takes much would wait for ever.

        Jobs on spot instances come last, and end for others that do not fit beside them.
        """
        free = self._capacity
        for work in self._work.values():
            free = free.without(self._capacity.taken_by(work.spec))
        for job in sorted(waiting, key=lambda job: job.spec.use_spot_instances):
            wanted = self._capacity.taken_by(job.spec)
            if not self._capacity.has(wanted) and self._home.is_shared:
                continue  # for a larger machine
            if not free.has(wanted):
                if not job.spec.use_spot_instances:
                    self._preempt(wanted, free)
                return
            if self._start(job):
                free = free.without(wanted)

    def _preempt(self, wanted: Capacity, free: Capacity) -> None:
        """End jobs on spot instances, the youngest first, if that is enough."""
        spot = [work for work in reversed(self._work.values()) if work.spec.use_spot_instances]
        taken = []
        for work in spot:
            if free.has(wanted):
                break
            taken.append(work)
            given = self._capacity.taken_by(work.spec)
            free = Capacity(free.cores + given.cores, free.memory_mib + given.memory_mib)
        if free.has(wanted):
            for work in taken:
                work.makes_room = True

    def _start(self, job: Job) -> bool:
        """Take a job and start its process; False: another supervisor was quicker."""
        now = self._clock()
        if not self._store.replace(job, job.claimed(self._name, now)):
            return False
        try:
            make_folder(self._home.folder(job.name))
            progress = progress_mark(self._home, job.spec)
            child = self._child(job)
        except (OSError, RacecraftError) as error:
            self._change(job.name, lambda job, why=str(error): job.finished(State.FAILED, now, why))  # type: ignore[misc]
            return True
        self._work[job.name] = Work(child, job.spec, progress)
        # Somebody may have asked it to stop between two of our lines; then it is stopping already.
        self._change(job.name, lambda job: job if job.state is State.STOPPING else job.started(child.pid, now))
        return True

    def _child(self, job: Job) -> Child:
        """Return a job's process: the one that waits for it, or a new one."""
        log = self._home.log(job.name)
        if self._spare is not None and (child := self._spare.assign(job.spec, log)) is not None:
            self._spare, self._took_spare = None, time.monotonic()
            return child
        if self._spare is not None and self._spare.warm:  # not ready: it would only take time from this training
            self._spare.dismiss()
            self._spare, self._took_spare = None, time.monotonic()
        return children.start(job.spec, log)

    def _have_ready(self, awaited: bool, warm: bool) -> None:
        """Have a process wait while a job was announced and has not come, and while a worker is to be kept warm."""
        if self._spare is not None and (self._spare.has_ended or not (awaited or warm)):
            self._spare.dismiss()
            self._spare = None
        if self._spare is None and awaited:
            self._spare = PreloadedProcess.if_awaited(self._home)
        elif (
            self._spare is None and warm and (not self.busy or time.monotonic() - self._took_spare > WARM_AFTER_SECONDS)
        ):
            with contextlib.suppress(OSError):
                self._spare = PreloadedProcess(self._home, warm=True)

    def _beat(self, jobs: list[Job]) -> None:
        """Let others see that our jobs are looked after."""
        now = self._clock()
        for job in jobs:
            if job.name in self._work and now - job.beat > BEAT_SECONDS:
                self._change(job.name, lambda job: job.heard_of(now))

    def _change(self, name: str, how: Callable[[Job], Job]) -> None:
        """Change a job if it is (still) there and ours to change, or nobody's."""
        with contextlib.suppress(JobError):
            change(self._store, name, lambda job: how(job) if job.owner in ("", self._name) else job)

    def _note_log_times(self) -> None:
        for name in self._work:
            self._note_log_time(name)

    def _note_log_time(self, name: str) -> None:
        """Write down how long a job's log is now, where it has grown."""
        log, times = self._home.log(name), self._home.log_times(name)
        with contextlib.suppress(OSError):
            size = log.stat().st_size
            if size > _noted(times):
                with open(times, "a", encoding="ascii") as file:
                    file.write(f"{self._clock():.2f} {size}\n")


def supervise(home: JobPaths, idle_seconds: float = IDLE_SECONDS, spare: PreloadedProcess | None = None) -> None:
    """Work at the jobs of a home until there is nothing left to do; return at once where somebody does already.

    Args:
        home: Where they lie.
        idle_seconds: How long it waits for another.
        spare: A process that waits for a job that was announced.
    """
    store = home.store()
    _end_on_signals()
    while True:
        lock = _lock(home)
        if lock is None:
            if spare is not None:
                spare.dismiss()
            return
        supervisor, spare = Supervisor(store, home, spare=spare), None
        try:
            _work(supervisor, idle_seconds)
        finally:
            supervisor.close()
            lock.release()
        if not store.open_jobs():  # whoever came while we were leaving saw the lock and left it to us
            return


def progress_mark(home: JobPaths, spec: JobSpec) -> float:
    """Return when a job last left something on the disk that it can go on from, seconds since 1970; 0 if never."""
    run = spec.run_folder()
    checkpoints = home.folder(spec.name) / "opt" / "ml" / "checkpoints"
    places = ([run / METRICS] if run else []) + [checkpoints]
    return max((place.stat().st_mtime for place in places if place.exists()), default=0.0)


def _work(supervisor: Supervisor, idle_seconds: float) -> None:
    idle_since = time.monotonic()
    while time.monotonic() - idle_since < idle_seconds:
        if supervisor.reconcile():
            idle_since = time.monotonic()
        time.sleep(supervisor.turn_seconds)


def _given_up(held: Job, seen: Job, now: float, why: str) -> Job:
    """Return a job that waits again, where it is as it was seen; one that should stop has stopped."""
    if held.revision != seen.revision:
        return held
    if held.state is State.STOPPING:
        return held.finished(held.ending or State.STOPPED, now, held.reason)
    return held.interrupted(now, why, progressed=True)


def _request_stop_in_run(spec: JobSpec) -> bool:
    """Ask a training to end as `racecraft stop` does; False where there is none to be asked."""
    path = spec.run_folder()
    if path is None or not children.has_begun(spec):
        return False
    try:
        RunFolder.open(path).request_stop()
    except RacecraftError:
        return False
    return True


def _lock(home: JobPaths) -> RunLock | None:
    """Become this machine's supervisor; None: there is one."""
    until = time.monotonic() + LOCK_PATIENCE_SECONDS  # somebody may just be looking whether there is one
    while True:
        try:
            return RunLock(home.path)
        except RunFolderError:
            if time.monotonic() > until:
                return None
            time.sleep(0.05)


def _noted(times: Path) -> int:
    """Return how long the log was at the last noted time."""
    if not times.exists():
        return 0
    with open(times, "rb") as file:
        file.seek(max(0, times.stat().st_size - 64))
        last = file.read().split(b"\n")[-2:-1]
    return int(last[0].split()[1]) if last else 0


def _end_on_signals() -> None:
    def leave(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    for name in ("SIGTERM", "SIGINT"):
        signal.signal(getattr(signal, name), leave)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.chdir(os.path.expanduser("~"))  # the folder it was started from may be taken away
