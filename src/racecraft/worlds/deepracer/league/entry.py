"""A car at entry: copied so that it can be driven from its own folder, and checked. Begin with `admit_car`.

A run, a checkpoint, an archive of a run folder, or a model of AWS's becomes a run folder with one checkpoint. What it
needs to drive is copied, nothing else: neither the reward function nor the folders in which it was trained. A policy
with classes of its owner's is refused, since to load it would run that code.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.world import DiscreteActions
from racecraft.formats.archive import Limits, is_archive, members, unpack
from racecraft.formats.atomic import write_atomic
from racecraft.formats.checkpoint import IMPORTED, Checkpoints
from racecraft.formats.checkpoint_ranking import load_weights, split_source
from racecraft.formats.run_folder import JOB, MODEL_METADATA, REWARD_FUNCTION, TRACK, RunFolder
from racecraft.training.custom_code import code_names
from racecraft.worlds.deepracer.league.rules import CarRules
from racecraft.worlds.deepracer.players.aws_model import import_model
from racecraft.worlds.deepracer.players.borrowed import is_foreign
from racecraft.worlds.deepracer.players.run_track import KIND
from racecraft.worlds.deepracer.players.trained_car import TrainedCar, load_trained_car

KEPT_OF_JOB = ("kind", "title", "algorithm", "track", "model_metadata", "settings", IMPORTED)
KEPT_OF_ENV = ("DR_RACER_NAME", "DR_CAR_NAME", "DR_CAR_COLOR", "DR_CAR_BODY_SHELL_TYPE")
ARCHIVE_KIND = "an archive of a run folder or of a DeepRacer model (.tar.gz or .zip)"
LIMITS = Limits(max_bytes=2 * 2**30, max_members=10_000)


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
            yield _run_in_archive(Path(path), Path(place)), which
    elif is_foreign(path):
        yield None, which
    else:
        yield RunFolder.open(path), which


def _run_in_archive(archive: Path, place: Path) -> RunFolder | None:
    """Unpack an archive of a run folder; None where it holds none."""
    jobs = [member.place for member in members(archive, ARCHIVE_KIND, LIMITS) if member.place.name == JOB]
    if not jobs:
        return None
    if len(jobs) > 1:
        raise SettingError("{archive} holds {count} run folders; expected one.", archive=archive, count=len(jobs))
    unpack(archive, place, ARCHIVE_KIND, LIMITS)
    return RunFolder.open(place / jobs[0].parent)


def _copy(run: RunFolder, which: str, folder: Path) -> None:
    """Make a run folder of one checkpoint of a run."""
    weights, card = load_weights(run, which)
    _require_no_code(run, card)
    job = run.read_job()
    env = {name: value for name, value in dict(job.get("env") or {}).items() if name in KEPT_OF_ENV}
    track = (job.get("asked") or {}).get("track")
    kept = {name: job[name] for name in KEPT_OF_JOB if name in job} | {"asked": {"track": track}, "env": env}

    def fill(copy: RunFolder) -> None:
        iteration, steps = int(card["iteration"]), int(card["steps"])
        Checkpoints(copy.checkpoints).save(iteration, steps, weights, card, best=True)
        for name in (MODEL_METADATA, TRACK):
            if (run.path / name).is_file():
                write_atomic(copy.path / name, (run.path / name).read_bytes())

    RunFolder.create(folder, kept, fill)


def _require_no_code(run: RunFolder, card: dict[str, Any]) -> None:
    """Refuse a policy that names classes of its owner's.

    Raises:
        SettingError: It does.
        PolicySpecError: It does not say what it is.
        RunFolderError: The checkpoint is of something else.
    """
    if not isinstance(card.get("policy_spec"), dict):
        raise RunFolderError(
            "{path}: its checkpoint does not say how its policy is built; expected one that racecraft wrote.",
            path=run.path,
        )
    names = list(code_names(PolicySpec.from_dictionary(card["policy_spec"])))
    if names:
        raise SettingError(
            "{path}: its policy brings code of its own ({names}); expected a policy of racecraft's own algorithms and "
            "networks. Races drive no code of racers.",
            path=run.path,
            names=", ".join(names),
        )
