"""What runs, what waits, what was done."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import psutil
from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.console.paging import page_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, page_routes
from racecraft.jobs.submit import request_stop


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of jobs."""
    return [
        *page_routes(console, "/jobs", jobs_page),
        act_route(console, "/jobs/{job}/stop", stop),
    ]


def jobs_page(console: Console, request: Request) -> Page:
    """Return every job of this account, of the command line as well."""
    now = time.time()
    jobs = console.home.store().jobs()
    done = page_of(
        "/jobs", request.query_params, [job for job in jobs if job.ended], lambda job: (-job.created, job.name)
    )
    found = [
        {
            "name": job.name,
            "command": " ".join(job.spec.command),
            "state": job.state.value,
            "reason": job.reason,
            "seconds": job.training_seconds(now),
            "model": _model(console, job.spec.run_folder()),
            "ended": job.ended,
            "waits": job.waits,
        }
        for job in [*(job for job in reversed(jobs) if not job.ended), *done.rows]
    ]
    return Page(
        "jobs.html",
        "Jobs",
        {
            "open": [job for job in found if not job["ended"]],
            "done": [job for job in found if job["ended"]],
            "pages": done.links,
            "cores": psutil.cpu_count() or 1,
            "load": [round(one, 2) for one in os.getloadavg()] if hasattr(os, "getloadavg") else [],
            "room_gb": shutil.disk_usage(console.workspace.path).free / 1e9,
        },
        here="/jobs",
    )


def stop(console: Console, request: Request, fields: Fields) -> str:
    """End a job; one that waits is taken out of the queue."""
    request_stop(console.home, console.home.store(), request.path_params["job"])
    console.watcher.refresh()
    return "/jobs"


def _model(console: Console, run: Path | None) -> str:
    """Return the name of the model a job trains; "": none of this workspace."""
    if run is None:
        return ""
    for folder in (run, run.parent.parent):
        if folder.parent.parent == console.workspace.path:
            return folder.name if console.workspace.find(folder.name) else ""
    return ""


SECTION = Section(routes=routes, label="Jobs", href="/jobs", icon="pulse", order=80)
