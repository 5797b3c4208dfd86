"""The map of a job's life, in SageMaker's words: five states for scripts, and under them what happens in detail."""

from __future__ import annotations

from enum import StrEnum

from racecraft.contract.errors import RacecraftError, UserInputError


class JobError(UserInputError):
    """A job cannot be what was asked for."""


class IllegalMove(RacecraftError):  # noqa: N818 - it reads better in a trace than with an Error behind
    """A job was told to become what it cannot become."""


class State(StrEnum):
    """What a job is doing (SageMaker: SecondaryStatus)."""

    PENDING = "Pending"
    """Waits for cores and memory."""
    STARTING = "Starting"
    """Somebody has taken it and starts its process."""
    TRAINING = "Training"
    INTERRUPTED = "Interrupted"
    """A signal, or the loss of its machine, ended its process; it waits to go on."""
    RESTARTING = "Restarting"
    STOPPING = "Stopping"
    """Somebody asked it to end, or its time is over; it still works."""
    STOPPED = "Stopped"
    MAX_RUNTIME_EXCEEDED = "MaxRuntimeExceeded"
    MAX_WAIT_TIME_EXCEEDED = "MaxWaitTimeExceeded"
    COMPLETED = "Completed"
    FAILED = "Failed"


QUEUED = (State.PENDING, State.INTERRUPTED)
"""Nobody works at it, and somebody should."""
WORKED_AT = (State.STARTING, State.RESTARTING, State.TRAINING, State.STOPPING)
ENDED = (State.STOPPED, State.MAX_RUNTIME_EXCEEDED, State.MAX_WAIT_TIME_EXCEEDED, State.COMPLETED, State.FAILED)

_ENDS_WITHOUT_WORK = {State.STOPPED, State.MAX_WAIT_TIME_EXCEEDED, State.FAILED}
MOVES: dict[State, set[State]] = {
    State.PENDING: {State.STARTING, *_ENDS_WITHOUT_WORK},
    State.STARTING: {State.TRAINING, State.INTERRUPTED, State.STOPPING, State.FAILED},
    State.TRAINING: {State.COMPLETED, State.INTERRUPTED, State.STOPPING, State.FAILED},
    State.INTERRUPTED: {State.RESTARTING, *_ENDS_WITHOUT_WORK},
    State.RESTARTING: {State.TRAINING, State.INTERRUPTED, State.STOPPING, State.FAILED},
    State.STOPPING: {State.STOPPED, State.MAX_RUNTIME_EXCEEDED, State.MAX_WAIT_TIME_EXCEEDED, State.FAILED},
    State.STOPPED: {State.PENDING},
    State.MAX_RUNTIME_EXCEEDED: {State.PENDING},
    State.MAX_WAIT_TIME_EXCEEDED: {State.PENDING},
    State.COMPLETED: {State.PENDING},
    State.FAILED: {State.PENDING},
}
"""What may become what; an ended job that is resumed waits again."""


def require_move(job: str, now: State, to: State) -> None:
    """Allow a move, or say which ones are open.

    Raises:
        IllegalMove: It is not on the map.

    >>> require_move("gym-1", State.PENDING, State.TRAINING)
    Traceback (most recent call last):
    racecraft.jobs.states.IllegalMove: Job gym-1 is Pending and can become Failed, MaxWaitTimeExceeded, Starting, \
Stopped; asked for Training.
    """
    if to not in MOVES[now]:
        raise IllegalMove(
            "Job {job} is {now} and can become {moves}; asked for {to}.",
            job=job,
            now=now,
            moves=", ".join(sorted(MOVES[now])),
            to=to,
        )


def status_of(state: State) -> str:
    """Return SageMaker's TrainingJobStatus: what a script asks for.

    >>> status_of(State.PENDING), status_of(State.MAX_RUNTIME_EXCEEDED), status_of(State.FAILED)
    ('InProgress', 'Stopped', 'Failed')
    """
    if state in (State.MAX_RUNTIME_EXCEEDED, State.MAX_WAIT_TIME_EXCEEDED):
        return "Stopped"
    return state.value if state in ENDED or state is State.STOPPING else "InProgress"
