"""A car at entry: copied so that it can be driven from its own folder, and checked. Begin with `admit_car`.

A run, a checkpoint, an archive of a run folder, or a model of AWS's becomes a run folder with one checkpoint
(`league/model_copy.py`).
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from racecraft.contract.world import DiscreteActions
from racecraft.formats.archive import is_archive
from racecraft.formats.checkpoint import IMPORTED
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import MODEL_METADATA, REWARD_FUNCTION, TRACK, RunFolder
from racecraft.league.model_copy import copy_checkpoint, run_in_archive
from racecraft.worlds.deepracer.league.rules import CarRules
from racecraft.worlds.deepracer.players.aws_model import import_model
from racecraft.worlds.deepracer.players.open_run import is_aws_model
from racecraft.worlds.deepracer.players.run_track import KIND
from racecraft.worlds.deepracer.players.trained_car import TrainedCar, load_trained_car

KEPT_OF_JOB = ("kind", "title", "algorithm", "track", "model_metadata", "settings", IMPORTED)
KEPT_OF_ENV = ("DR_RACER_NAME", "DR_CAR_NAME", "DR_CAR_COLOR", "DR_CAR_BODY_SHELL_TYPE")
ARCHIVE_KIND = "an archive of a run folder or of a DeepRacer model (.tar.gz or .zip)"


def admit_car(source: str, folder: Path, rules: CarRules) -> dict[str, Any]:
    """Copy a car into a folder that does not exist yet, check it, and return its facts.

    Args:
        source: RUN[:best|last|N|…], an archive, or a model of AWS's.
        folder: Becomes a run folder.
        rules: Of the race.

    Raises:
        UserInputError: It cannot be used, or the rules refuse it.
    """
    with _as_run(source) as (run, which):
        if run is None:
            import_model(split_source(source)[0], folder)
            (folder / REWARD_FUNCTION).unlink(missing_ok=True)
        else:
            run.read_job_of(KIND)
            _copy(run, which, folder)
    car = load_trained_car(folder)
    facts = facts_of(car)
    rules.check(facts)
    return facts


def facts_of(car: TrainedCar) -> dict[str, Any]:
    """Return what rules ask of a car, fit for JSON."""
    spec = car.actions.spec
    sensors = car.sensors
    return {
        "car": car.settings.race.car,
        "sensors": [sensors.camera, *([sensors.lidar.name] if sensors.lidar else [])],
        "max_speed_mps": round(car.actions.fastest, 6),
        "actions": spec.count if isinstance(spec, DiscreteActions) else None,
        "algorithm": car.run.read_job().get("algorithm", ""),
        "checkpoint": car.checkpoint.iteration,
        "trained_on": car.trained_on.name,
        "metadata_version": car.version,
    }


@contextlib.contextmanager
def _as_run(source: str) -> Iterator[tuple[RunFolder | None, str]]:
    """Yield a run of ours with the checkpoint's name; None for a model of AWS's."""
    path, which = split_source(source)
    if is_archive(path):
        with tempfile.TemporaryDirectory(prefix="racecraft-entry-", ignore_cleanup_errors=True) as place:
            yield run_in_archive(Path(path), Path(place), ARCHIVE_KIND), which
    elif is_aws_model(path):
        yield None, which
    else:
        yield RunFolder.open(path), which


def _copy(run: RunFolder, which: str, folder: Path) -> None:
    """Make a run folder of one checkpoint of a run."""
    job = run.read_job()
    env = {name: value for name, value in dict(job.get("env") or {}).items() if name in KEPT_OF_ENV}
    track = (job.get("asked") or {}).get("track")
    kept = {name: job[name] for name in KEPT_OF_JOB if name in job} | {"asked": {"track": track}, "env": env}
    copy_checkpoint(run, which, folder, kept, (MODEL_METADATA, TRACK))
