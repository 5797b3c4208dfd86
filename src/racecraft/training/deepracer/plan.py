"""What was asked for, made definite: every file read, every setting settled, nothing started. Begin with `plan_car`."""

from __future__ import annotations

import platform
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from racecraft import __version__
from racecraft.contract.errors import RunFolderError, TrackError
from racecraft.envs.deepracer.actions import ActionSpace, action_space
from racecraft.formats.aws.model_metadata import as_aws_dict
from racecraft.formats.aws.run_env import RunEnv
from racecraft.formats.run_folder import RunFolder
from racecraft.players.deepracer.trained_car import KIND
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import as_dictionary, from_dictionary, with_values
from racecraft.tracks.catalogue import load_track
from racecraft.tracks.track import Track
from racecraft.training.deepracer.aws.setup import FROM_ENV
from racecraft.training.deepracer.model_folder import ModelFolder, read_model_folder
from racecraft.training.deepracer.presets import settings_for, stops_given
from racecraft.training.deepracer.race_environment import TRACK_VARIABLE, race_environment
from racecraft.training.stopping import Stop, parse_stops

DEFAULT_TRACK = "reinvent_base"
DEFAULT_STOPS = ("laps", "minutes=30")


@dataclass(frozen=True)
class RaceRequest:
    """What was asked: everything a training begins from."""

    folder: Path | None = None
    """Folder with reward_function.py, hyperparameters.json, model_metadata.json; None: defaults."""
    track: str | None = None
    """A name of the catalogue, or a waypoint file; None: what run.env says, or DEFAULT_TRACK."""
    car: str | None = None
    """Vehicle profile; None: by the version in the metadata."""
    preset: str = "fast"
    fidelity: str | None = None
    """"sane" or "aws"; None: the one that goes with the preset."""
    stops: tuple[str, ...] = ()
    """As typed; none: DEFAULT_STOPS."""
    run: Path | None = None
    """Run folder to make; None: runs/<track>-<number>."""
    seed: int = 1
    overrides: tuple[str, ...] = ()
    """group.name=value, as typed."""
    clone_from: str | None = None
    """RUN, RUN:best, RUN:last or RUN:N, whose weights the training begins with; None: fresh weights."""


@dataclass(frozen=True)
class CarPlan:
    """A request made definite."""

    request: RaceRequest
    model: ModelFolder
    settings: TrainSettings
    track: Track
    stops: tuple[Stop, ...]
    notes: tuple[str, ...] = field(default=())
    """What is worth saying before the first tick, a clause each."""
    env: Mapping[str, str] = field(default_factory=dict)
    """The racer's run.env, as it was read; what the AWS files repeat of it goes into job.json too."""
    judging: Mapping[str, int | str] = field(default_factory=dict)
    """What `racecraft evaluate` does with the run where it is not told otherwise."""

    @property
    def actions(self) -> ActionSpace:
        """What the car can be told."""
        return action_space(self.model.metadata.action_space)


def plan_car(request: RaceRequest) -> CarPlan:
    """Read and check everything a request names; nothing is written.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
    """
    asked = race_environment(request.folder)
    offset = () if asked.start_offset is None else (f"race.start_offset={asked.start_offset}",)
    request = replace(
        request,
        track=request.track or asked.track or DEFAULT_TRACK,
        stops=request.stops or asked.stops or DEFAULT_STOPS,
        overrides=(*offset, *asked.overrides, *request.overrides),
        clone_from=request.clone_from or asked.clone_from,
    )
    model = read_model_folder(asked.files or request.folder)
    stops = parse_stops((*request.stops, *stops_given(model.hyperparameters)))
    settings, notes = settings_for(
        request.preset, model.hyperparameters, request.overrides, request.fidelity, model.metadata
    )
    if not any(override.startswith("race.car=") for override in request.overrides):
        settings = with_values(settings, "race", {"car": request.car or model.metadata.car})
    track = _load_track(request, asked.env)
    return CarPlan(
        request, model, settings, track, stops, (*asked.notes, *model.notes, *notes), asked.env.values, asked.judging
    )


def plan_resume(path: Path, stops: tuple[str, ...] = ()) -> CarPlan:
    """Read what a run was asked for, from its own folder, so that it can go on.

    Args:
        path: The run folder; its copies of the racer's files are used.
        stops: New stops; none: those the run was begun with.

    Raises:
        RunFolderError: No run of a car, or its track is no longer the one it was begun on.
    """
    run = RunFolder.open(path)
    job = run.read_job_of(KIND)
    _require_copies(run)
    asked = job["asked"]
    track = load_track(asked["track"])
    if track.hash() != job["track"]["hash"]:
        raise RunFolderError(
            f"{path}: its track {asked['track']!r} has changed since the run began (now {track.hash()}, then "
            f"{job['track']['hash']}); expected the same waypoints. Restore the file, or begin a new run with --from."
        )
    request = RaceRequest(
        folder=path,
        track=asked["track"],
        preset=asked["preset"],
        stops=stops or tuple(asked["stops"]),
        run=path,
        seed=job["seed"],
        overrides=tuple(asked["set"]),
    )
    notes = ["globals of the reward function's module start anew"]
    if job["versions"] != versions():
        notes.append(f"versions differ from those the run began with ({job['versions']}): the curve may differ")
    settings = from_dictionary(TrainSettings, job["settings"])
    return CarPlan(
        request, read_model_folder(path), settings, track, parse_stops(request.stops), tuple(notes), job.get("env", {})
    )


def job_card(plan: CarPlan, threads: int) -> dict[str, Any]:
    """Return what job.json holds: what was asked, with settings, seed, versions and the track's hash."""
    request = plan.request
    return {
        "kind": KIND,
        "asked": {
            "folder": None if request.folder is None else str(request.folder),
            "track": _lasting_name(_track_of(request)),
            "preset": request.preset,
            "stops": [str(stop) for stop in plan.stops],
            "set": list(request.overrides),
            "from": request.clone_from,
        },
        "track": {"name": plan.track.name, "hash": plan.track.hash(), "length_m": plan.track.length},
        "settings": as_dictionary(plan.settings),
        "evaluate": dict(plan.judging),
        "env": {name: plan.env[name] for name in FROM_ENV.values() if name in plan.env},
        "model_metadata": as_aws_dict(plan.model.metadata),
        "seed": request.seed,
        "versions": versions(),
        "threads": threads,
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def policy_card(plan: CarPlan) -> dict[str, Any]:
    """Return what a stranger needs to rebuild the policy; it goes into every checkpoint."""
    return {
        "kind": KIND,
        "settings": as_dictionary(plan.settings),
        "model_metadata": as_aws_dict(plan.model.metadata),
        "track": plan.track.name,
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    names = ("torch", "numba", "numpy")
    return {"racecraft": __version__, "python": platform.python_version(), **{name: version(name) for name in names}}


def _load_track(request: RaceRequest, env: RunEnv) -> Track:
    """Load the track; where run.env named it, a letter about it names that line."""
    name = _track_of(request)
    try:
        return load_track(name)
    except TrackError as error:
        if env.values.get(TRACK_VARIABLE) != name:
            raise
        found = f"'{name}': {error.found}"
        raise env.letter(TRACK_VARIABLE, error.expected, error.cure, found) from error


def _require_copies(run: RunFolder) -> None:
    """Refuse to go on without a file the run was begun with: a default in its place would be another training."""
    for copy in (run.reward_function, run.model_metadata, run.hyperparameters):
        if not copy.is_file():
            raise RunFolderError(
                f"{copy}: the run's own copy is gone; expected the file it was begun with. Put it back, or begin a new "
                f"run from these weights with --from {run.path}."
            )


def _track_of(request: RaceRequest) -> str:
    return request.track or DEFAULT_TRACK


def _lasting_name(track: str) -> str:
    """Return a waypoint file's absolute path, so that the run can be used from another folder; names stay names."""
    return str(Path(track).resolve()) if Path(track).is_file() else track
