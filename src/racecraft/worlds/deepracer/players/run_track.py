"""Where a car's run was driven. A room that only looks at a run needs no network to know it."""

from __future__ import annotations

from racecraft.contract.errors import TrackError
from racecraft.contract.message import Message
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import import_track
from racecraft.worlds.deepracer.tracks.track import Track

KIND = "deepracer"
"""What job.json calls a run of a car."""


def track_of_run(run: RunFolder) -> Track:
    """Return the track a car was trained on: the run's own copy of it, or the catalogue's.

    Raises:
        TrackError: It is gone, or no longer makes a circuit.
    """
    job = run.read_job_of(KIND)
    name = job["asked"]["track"]
    if job["track"].get("copy") and not run.track.is_file():
        raise TrackError(
            run.track,
            "there is no such file",
            Message("the run's own copy of its track {name!r}", name=name),
            "Put it back.",
        )
    return import_track(run.track, name) if run.track.is_file() else load_track(name)
