"""What is printed of a job that was just put into the queue."""

from __future__ import annotations

from racecraft.actions.submit_job import Submitted


def show_submitted(submitted: Submitted) -> None:
    """Say that a job is on its way, and what can be done with it."""
    job = submitted.job
    where = f", run {job.spec.run}" if job.spec.run else ""
    print(f"job {job.name} goes on by itself{where}; this terminal may be closed")
    print(f"  racecraft jobs logs -f {job.name}     # watch it")
    print(f"  racecraft jobs stop {job.name}        # end it; `jobs resume` goes on later")
