"""A job's life on its map, without a process."""

import pytest

from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.job import new_job
from racecraft.jobs.states import IllegalMove, JobError, State


def begun(**more):
    return new_job(JobSpec(("gym", "train"), "gym-1", **more), 100.0)


def training():
    return begun().claimed("me", 101.0).started(7, 102.0)


def test_a_job_that_completes_says_when_each_step_was():
    job = training().finished(State.COMPLETED, 110.0)
    assert [(step.state.value, step.time) for step in job.transitions] == [
        ("Pending", 100.0), ("Starting", 101.0), ("Training", 102.0), ("Completed", 110.0),
    ]  # fmt: skip
    assert (job.owner, job.process, job.ended_at, job.training_seconds(500.0)) == ("", None, 110.0, 9.0)


def test_waiting_is_no_training():
    job = training().interrupted(110.0, "ended by SIGKILL", progressed=True).claimed("you", 200.0).started(8, 201.0)
    assert job.training_seconds(204.0) == 9.0 + 4.0
    assert (job.attempts, job.owner) == (2, "you")


def test_progress_forgives_what_came_before():
    job = training()
    for progressed in (False, False, True, False, False):
        job = job.interrupted(110.0, "ended by SIGKILL", progressed).claimed("me", 111.0).started(9, 112.0)
    assert job.state is State.TRAINING


def test_a_job_that_waits_stops_at_once_one_that_trains_is_asked():
    assert begun().with_stop_requested(101.0, "asked to stop").state is State.STOPPED
    asked = training().with_stop_requested(103.0, "its time is over", State.MAX_RUNTIME_EXCEEDED)
    assert (asked.state, asked.ending, asked.owner) == (State.STOPPING, State.MAX_RUNTIME_EXCEEDED, "me")
    assert asked.with_stop_requested(104.0, "again") is asked


def test_a_job_that_is_stopped_before_its_process_could_begin_may_still_fail():
    job = begun().claimed("me", 101.0).with_stop_requested(102.0, "asked to stop")
    assert job.finished(State.FAILED, 103.0, "its folder is gone").status == "Failed"


def test_only_what_has_ended_is_resumed():
    with pytest.raises(JobError, match="gym-1 is Training; expected one that has ended"):
        training().resumed(110.0)
    again = training().finished(State.FAILED, 110.0, "exit code 1").resumed(120.0)
    assert (again.state, again.barren) == (State.PENDING, 0)


def test_what_is_not_on_the_map_is_refused():
    with pytest.raises(IllegalMove, match="Completed and can become Pending; asked for Training"):
        training().finished(State.COMPLETED, 110.0).started(3, 111.0)
