"""One job as it stands, and every legal change of it; a change is a new value, which a store takes or refuses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from racecraft.formats.job_spec import JobSpec, spec_of
from racecraft.jobs.states import ENDED, QUEUED, WORKED_AT, JobError, State, require_move, status_of

BARREN_ATTEMPTS = 3
"""A job that a signal ended so often in a row, and nothing new lies on the disk, has failed."""


@dataclass(frozen=True)
class Transition:
    """One step of a job's life."""

    state: State
    time: float
    """Seconds since 1970."""
    message: str = ""


@dataclass(frozen=True)
class Job:
    """A job as it stands in a store."""

    spec: JobSpec
    created: float
    """Seconds since 1970."""
    state: State = State.PENDING
    revision: int = 0
    """Counts the changes; a store takes a change only of what it still holds."""
    owner: str = ""
    """The supervisor that works at it; "": none."""
    beat: float = 0.0
    """When its owner was last heard of, seconds since 1970."""
    process: int | None = None
    """Its process while somebody works at it."""
    attempts: int = 0
    """How often it was started."""
    barren: int = 0
    """Attempts in a row, ended by a signal, that left nothing new on the disk."""
    ending: State | None = None
    """What it becomes when it has stopped."""
    reason: str = ""
    """Why it stands as it does; of a failure, what was last said."""
    transitions: tuple[Transition, ...] = ()

    @property
    def name(self) -> str:
        """Its name."""
        return self.spec.name

    @property
    def status(self) -> str:
        """SageMaker's TrainingJobStatus."""
        return status_of(self.state)

    @property
    def ended(self) -> bool:
        """Whether nobody works at it, nor will."""
        return self.state in ENDED

    @property
    def waits(self) -> bool:
        """Whether nobody works at it, and somebody should."""
        return self.state in QUEUED

    @property
    def worked_at(self) -> bool:
        """Whether it has an owner."""
        return self.state in WORKED_AT

    @property
    def ended_at(self) -> float | None:
        """When it ended; None while it has not."""
        return self.transitions[-1].time if self.ended else None

    def training_seconds(self, now: float) -> float:
        """Return for how long somebody has worked at it, waiting left out."""
        total, started = 0.0, None
        for step in self.transitions:
            if step.state in WORKED_AT and started is None:
                started = step.time
            elif step.state not in WORKED_AT and started is not None:
                total, started = total + step.time - started, None
        return total if started is None else total + now - started

    def moved(self, to: State, now: float, message: str = "", **changes: Any) -> Job:
        """Return the job one step further.

        Raises:
            IllegalMove: The map has no such step.
        """
        require_move(self.name, self.state, to)
        step = Transition(to, now, message)
        return replace(self, state=to, reason=message, transitions=(*self.transitions, step), **changes)

    def claimed(self, owner: str, now: float) -> Job:
        """Return the job taken by a supervisor."""
        to = State.STARTING if self.state is State.PENDING else State.RESTARTING
        return self.moved(to, now, owner=owner, beat=now, attempts=self.attempts + 1)

    def started(self, process: int, now: float) -> Job:
        """Return the job with a process."""
        return self.moved(State.TRAINING, now, process=process)

    def interrupted(self, now: float, message: str, progressed: bool) -> Job:
        """Return the job waiting to go on, or failed where going on has led nowhere."""
        barren = 0 if progressed else self.barren + 1
        if barren >= BARREN_ATTEMPTS:
            said = f"{message}, {barren} times in a row without anything new on the disk"
            return self.moved(State.FAILED, now, said, owner="", process=None, barren=barren)
        return self.moved(State.INTERRUPTED, now, message, owner="", process=None, barren=barren)

    def finished(self, to: State, now: float, message: str = "") -> Job:
        """Return the job ended."""
        return self.moved(to, now, message, owner="", process=None, ending=None)

    def with_stop_requested(self, now: float, message: str, ending: State = State.STOPPED) -> Job:
        """Return the job on its way to its end; one that ends already, or has, as it is."""
        if self.ended or self.state is State.STOPPING:
            return self
        if self.waits:
            return self.finished(ending, now, message)
        return self.moved(State.STOPPING, now, message, ending=ending)

    def resumed(self, now: float, spec: JobSpec | None = None) -> Job:
        """Return the job waiting again.

        Raises:
            JobError: It has not ended.
        """
        if not self.ended:
            raise JobError(
                "Job {name} is {state}; expected one that has ended. `racecraft jobs stop` ends it.",
                name=self.name,
                state=self.state,
            )
        return replace(self.moved(State.PENDING, now, "resumed"), barren=0, spec=spec or self.spec)

    def heard_of(self, now: float) -> Job:
        """Return the job with a fresh beat."""
        return replace(self, beat=now)

    def as_dictionary(self) -> dict[str, Any]:
        """Return all of it in plain values; `job_of` reads them."""
        return {
            **{name: getattr(self, name) for name in _PLAIN},
            "spec": self.spec.as_dictionary(),
            "state": self.state.value,
            "ending": self.ending and self.ending.value,
            "transitions": [[step.state.value, step.time, step.message] for step in self.transitions],
        }


_PLAIN = ("created", "revision", "owner", "beat", "process", "attempts", "barren", "reason")


def job_of(values: Mapping[str, Any]) -> Job:
    """Return the job that `Job.as_dictionary` told."""
    return Job(
        spec=spec_of(values["spec"]),
        state=State(values["state"]),
        ending=State(values["ending"]) if values["ending"] else None,
        transitions=tuple(Transition(State(state), time, message) for state, time, message in values["transitions"]),
        **{name: values[name] for name in _PLAIN},
    )


def new_job(spec: JobSpec, now: float) -> Job:
    """Return a job that waits for its first supervisor."""
    return Job(spec, now, transitions=(Transition(State.PENDING, now),))
