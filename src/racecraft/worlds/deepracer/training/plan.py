"""What was asked for, made definite: every file read, every setting settled, nothing started. Begin with `plan_car`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from racecraft.algorithms.registry import Algorithm, find_algorithm
from racecraft.contract.errors import RunFolderError, SettingError, TrackError
from racecraft.contract.message import Message
from racecraft.formats.checkpoint import IMPORTED
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.formats.run_folder import TRACK as RUN_TRACK
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import from_dictionary
from racecraft.training.partition import Block
from racecraft.training.request import DEFAULT_ALGORITHM, TrainRequest
from racecraft.training.stopping import GAP, LAPS, StopCondition, parse_stops
from racecraft.training.versions import versions
from racecraft.worlds.deepracer.driving.known_laps import best_known_lap, direction_of
from racecraft.worlds.deepracer.env.actions import ActionSpace, action_space
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.placing import plan_objects
from racecraft.worlds.deepracer.env.sensors import Sensors, car_sensors
from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL, TIME_TRIAL, RaceConfig, objects_of, with_race_groups
from racecraft.worlds.deepracer.env.vehicle import PROFILES, beyond_logs
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder
from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict, racing_model_metadata
from racecraft.worlds.deepracer.files.reward_source import RewardSource
from racecraft.worlds.deepracer.files.run_env import RunEnv
from racecraft.worlds.deepracer.players.open_run import with_metadata
from racecraft.worlds.deepracer.players.run_courses import LaidCourse, cars_on, courses_of_job, held_out_of_job, of_race
from racecraft.worlds.deepracer.players.trained_car import KIND, track_of_run
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import travels
from racecraft.worlds.deepracer.tracks.track import Track
from racecraft.worlds.deepracer.training.aws.setup import FROM_ENV
from racecraft.worlds.deepracer.training.car_choice import choose_car, table_notes, waypoint_notes
from racecraft.worlds.deepracer.training.courses import Course, load_courses, notes_on_courses
from racecraft.worlds.deepracer.training.groups import ALL, Group, requested_groups, track_names, worlds_for
from racecraft.worlds.deepracer.training.hold_out import as_dictionary as held_out_as_dictionary
from racecraft.worlds.deepracer.training.hold_out import held_out_tracks, require_apart, twins_of
from racecraft.worlds.deepracer.training.model_folder import ModelFolder, notes_in, read_model_folder
from racecraft.worlds.deepracer.training.presets import (
    ASKED_BY,
    RACE_STEPS,
    default_settings,
    settings_for,
    stops_given,
)
from racecraft.worlds.deepracer.training.race_environment import TRACK_VARIABLE, RaceEnvironment, read_race_environment

DEFAULT_TRACK = "reinvent_base"
DEFAULT_STOPS = ("laps", "minutes=30")
ITSELF = "self"
"""Word of --against: the learner's own past."""
STOPS_AGAINST = ("minutes=10",)
"""A car that laps alone has not learned to race."""


@dataclass(frozen=True)
class RaceRequest(TrainRequest):
    """What was asked: everything a car's training begins from."""

    kind: ClassVar[str] = KIND
    folder: Path | None = None
    """Folder with reward_function.py, hyperparameters.json, model_metadata.json; None: defaults."""
    track: str | None = None
    """A name of the catalogue, or a waypoint file; None: what run.env says, or DEFAULT_TRACK."""
    car: str | None = None
    """Vehicle profile; None: by the version in the metadata. Without model_metadata.json a car that races has the
    actions of its profile."""
    preset: str | None = None
    """None: `race` for one car in a time trial on one track with PPO, else `fast`."""
    fidelity: str | None = None
    """"sane" or "aws"; None: the one that goes with the preset."""
    against: tuple[str, ...] = ()
    """Whom the car races: ITSELF, RUN[:best|last|N], a model of AWS's, or a folder of runs; none: nobody, or itself
    where the race is HEAD_TO_MODEL."""
    drfc: DrfcFolder | None = None
    """The installation of DeepRacer for Cloud that asks; its bucket holds the files and, in the end, the run."""
    tracks: tuple[str, ...] = ()
    """Several tracks that are trained on together, comma lists of them, or "all"; the first is the training's own."""
    groups: tuple[Group, ...] = ()
    """What is said of each group of cars, as `groups.py` reads it; none: all race alike."""
    hold_out: tuple[str, ...] = ()
    """Tracks that are judged on at every evaluation and never trained on."""
    trust_reward: bool = False
    """Whether the reward function keeps all rights of the user."""


@dataclass(frozen=True)
class CarPlan:
    """A request made definite."""

    request: RaceRequest
    model: ModelFolder
    algorithm: Algorithm
    settings: Settings
    track: Track
    stops: tuple[StopCondition, ...]
    notes: tuple[str, ...] = field(default=())
    """What is worth saying before the first tick, a clause each."""
    env: Mapping[str, str] = field(default_factory=dict)
    """The racer's run.env, as it was read; what the AWS files repeat of it goes into job.json too."""
    judging: Mapping[str, bool | int | float | str] = field(default_factory=dict)
    """What `racecraft evaluate` does with the run where it is not told otherwise."""
    against: tuple[str, ...] = ()
    """Whom the car races, as `RaceRequest.against`; empty: nobody."""
    courses: tuple[LaidCourse, ...] = ()
    """The courses that cars are shared out among; empty: all drive on `track` as `settings.race` says."""
    held_out: tuple[Track, ...] = ()
    """Tracks that are judged on only, with the training's own race."""
    blocks: tuple[Block, ...] = ()
    """Which cars of each course are driven, where others drive the rest; empty: all."""

    @property
    def parts(self) -> tuple[int, ...]:
        """How many cars drive on each course; races against others are on one."""
        cars = self.settings.rollout.num_worlds
        return tuple(cars_on(self.courses, cars)) if self.courses and not self.against else (cars,)

    def of_blocks(self, blocks: tuple[Block, ...]) -> CarPlan:
        """Return the plan with some of the cars of each course."""
        return replace(self, blocks=blocks)

    @property
    def all_courses(self) -> tuple[LaidCourse, ...]:
        """The courses that are trained on; of one alone that one."""
        return self.courses or (LaidCourse(self.track, of_race(self.settings)),)

    @property
    def judged_courses(self) -> tuple[LaidCourse, ...]:
        """The same as they are judged: each way by itself where directions alternate."""
        return tuple(way.judged for course in self.all_courses for way in course.ways)

    @property
    def held_out_courses(self) -> tuple[LaidCourse, ...]:
        """The courses that are judged on only."""
        return tuple(LaidCourse(track, of_race(self.settings)).judged for track in self.held_out)

    @property
    def seed(self) -> int:
        """Of the learner, the worlds and exploration."""
        return 1 if self.request.seed is None else self.request.seed

    @property
    def actions(self) -> ActionSpace:
        """What the car can be told."""
        return action_space(self.model.metadata.action_space)

    @property
    def sensors(self) -> Sensors:
        """What the car sees with."""
        metadata = self.model.metadata
        return car_sensors(metadata.sensors, metadata.lidar_config)


def plan_car(request: RaceRequest) -> CarPlan:
    """Read and check everything a request names; nothing is written.

    Raises:
        UserInputError: Something cannot be used.
    """
    environment, model = _files_of(request)
    algorithm = find_algorithm(request.algorithm or ASKED_BY[model.metadata.training_algorithm])
    preset = _preset_of(request, algorithm, (*environment.overrides, *request.overrides), bool(environment.courses))
    request = replace(request, preset=preset)
    is_racing = preset == "race"
    if is_racing:
        default = racing_model_metadata(request.car or RaceConfig.car)
        model = read_model_folder(environment.files or request.folder, environment.keys, default)
    offset = () if environment.start_offset is None else (f"race.start_offset={environment.start_offset}",)
    held_out = held_out_tracks(request.hold_out)
    named, groups = _groups(request, held_out)
    request = replace(
        request,
        track=(groups[0].track if groups else None) or (named[0] if named else environment.track) or DEFAULT_TRACK,
        stops=request.stops or environment.stops or _default_stops(request),
        overrides=(*offset, *environment.overrides, *request.overrides, *_race_of(request, environment.overrides)),
        clone_from=with_metadata(request.clone_from or environment.clone_from, model.metadata),
    )
    if request.car is not None and request.car not in PROFILES:
        raise SettingError(
            "--car {car}: there is no such car; expected {profiles}.", car=request.car, profiles=" or ".join(PROFILES)
        )
    stops = parse_stops((*request.stops, *stops_given(model.hyperparameters, preset)), LAPS)
    wanted = worlds_for(groups) if preset != "aws" else ()
    overrides = (*wanted, *request.overrides)
    settings, notes = settings_for(
        preset, model.hyperparameters, overrides, request.fidelity, model.metadata, algorithm
    )
    is_set = any(override.startswith("race.car=") for override in request.overrides)
    settings, car_notes = choose_car(settings, model.metadata, request.car, is_set, request.folder)
    track = _load_track(request, environment.env)
    plan_objects(track, objects_of(settings), habits(settings.race.fidelity))  # refuses what does not fit
    courses = load_courses(groups or environment.courses, track, settings, TRACK_VARIABLE)
    _require_drivable(courses, held_out, settings)
    apart = require_apart([course.track for course in courses] or [track], held_out)
    remarks = notes_in(model, settings.race.type, is_racing)
    fastest = action_space(model.metadata.action_space).fastest
    limits = beyond_logs(settings.race.car, fastest)
    notes = [
        *environment.notes,
        *remarks,
        *notes,
        *car_notes,
        *filter(None, [limits]),
        *waypoint_notes(settings, track),
        *apart,
    ]
    if groups and environment.courses:
        notes.append("the courses of run.env and its workers are not driven: the command names others")
    plan = CarPlan(
        request,
        model,
        algorithm,
        settings,
        track,
        stops,
        (
            *notes,
            *table_notes(settings, model.metadata, track),
            *notes_on_courses(courses, settings),
            *_notes_on_held_out(held_out),
        ),
        environment.env.values,
        environment.judging,
        request.against or ((ITSELF,) if settings.race.type == HEAD_TO_MODEL else ()),
        courses,
        held_out,
    )
    _require_known_lap(plan)
    return plan


def known_lap_of(plan: CarPlan) -> float | None:
    """Return the best known lap of the plan's track, car and top speed, s; None where there is none."""
    track = plan.all_courses[0].track.name
    race = plan.settings.race
    return best_known_lap(track, race.car, plan.actions.fastest, direction_of(race.reverse))


def _require_known_lap(plan: CarPlan) -> None:
    """Refuse to wait for a gap to a lap that nobody knows."""
    gaps = [stop for stop in plan.stops if stop.kind == GAP]
    if gaps and known_lap_of(plan) is None:
        raise SettingError(
            "--stop {gaps}: found no best known lap of {name} with the car {car} at "
            "{fastest:g} m/s; expected one to compare with. Say --stop lap=SECONDS.",
            gaps=gaps[0],
            name=plan.track.name,
            car=plan.settings.race.car,
            fastest=plan.actions.fastest,
        )


def _files_of(request: RaceRequest) -> tuple[RaceEnvironment, ModelFolder]:
    """Read run.env and the racer's files.

    Raises:
        UserInputError: All faults of all of them.
    """
    environment, faults = read_race_environment(request.folder, request.clone_from is None, request.drfc)
    with faults.collect():
        model = read_model_folder(environment.files or request.folder, environment.keys)
    if faults.found and not request.track and environment.track:  # otherwise the plan loads it, and refuses it
        with faults.collect():
            _load_track(replace(request, track=environment.track), environment.env)
    faults.raise_found()
    return environment, model


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
    if IMPORTED in job:
        raise RunFolderError(
            "{path}: was imported from {job}, which holds nothing of its trainer's state; expected a run "
            "that was trained here. Begin a new one with its weights: --from {path}.",
            path=path,
            job=job[IMPORTED],
        )
    _require_copies(run)
    asked = job["asked"]
    track = track_of_run(run)
    if track.hash() != job["track"]["hash"]:
        place = run.track if run.track.is_file() else path
        raise RunFolderError(
            "{place}: its track {asked!r} has changed since the run began (now {hash}, then "
            "{job}); expected the same waypoints. Restore the file, or begin a new run with --from.",
            place=place,
            asked=asked["track"],
            hash=track.hash(),
            job=job["track"]["hash"],
        )
    request = RaceRequest(
        folder=path,
        track=asked["track"],
        preset=asked["preset"],
        algorithm=job.get("algorithm", DEFAULT_ALGORITHM),
        stops=stops or tuple(asked["stops"]),
        run=path,
        seed=job["seed"],
        overrides=tuple(asked["set"]),
    )
    model = read_model_folder(path)
    notes = [] if model.reward is None else _notes_on_state(model.reward)
    if job["versions"] != versions():
        notes.append(f"versions differ from those the run began with ({job['versions']}): the curve may differ")
    algorithm = find_algorithm(request.algorithm or DEFAULT_ALGORITHM)
    settings = with_race_groups(from_dictionary(default_settings(algorithm), job["settings"]))
    return CarPlan(
        request,
        model,
        algorithm,
        settings,
        track,
        parse_stops(request.stops, LAPS),
        tuple(notes),
        job.get("env", {}),
        against=tuple(asked.get("against", ())),
        courses=courses_of_job(job.get("courses", []), settings, track, run.tracks),
        held_out=held_out_of_job(job.get("held_out", []), run.tracks),
    )


def request_values(plan: CarPlan) -> dict[str, Any]:
    """Return what job.json holds of the request: enough to begin again from it."""
    request = plan.request
    return {
        "folder": None if request.folder is None else request.folder.resolve().name,
        "track": plan.track.name,
        "preset": request.preset,
        "set": list(request.overrides),
        **_groups_of_request(request),
        "against": list(plan.against),
        "from": None if request.clone_from is None else _source_name(request.clone_from),
    }


def job_of(plan: CarPlan) -> dict[str, Any]:
    """Return what else job.json tells of a car's training: the track's hash, what run.env said, the car."""
    return {
        "track": {
            "name": plan.track.name,
            "hash": plan.track.hash(),
            "length_m": plan.track.length,
            "copy": RUN_TRACK if travels(plan.track) else None,
        },
        "courses": [course.as_dictionary() for course in plan.courses],
        "held_out": [held_out_as_dictionary(track) for track in plan.held_out],
        "evaluate": dict(plan.judging),
        "env": {name: plan.env[name] for name in FROM_ENV.values() if name in plan.env},
        "model_metadata": as_aws_dict(plan.model.metadata),
    }


def _groups(request: RaceRequest, held_out: Sequence[Track]) -> tuple[list[str], tuple[Course, ...]]:
    """Return the tracks that are typed, and the courses on them as they were asked for.

    Raises:
        SettingError: Both one track and several are named, or a group that cannot be.
    """
    if request.track and request.tracks:
        raise SettingError("--track and --tracks were given; expected all names after one of them.")
    away = twins_of(held_out) if held_out and ALL in request.tracks else ()
    named = [request.track] if request.track else track_names(request.tracks, away)
    return named, requested_groups(named, request.groups)


def _require_drivable(courses: Sequence[LaidCourse], held_out: Sequence[Track], settings: Settings) -> None:
    """Refuse courses that go without a car, and objects that do not fit on one."""
    if courses:
        cars_on(tuple(courses), settings.rollout.num_worlds)
    everywhere = [(course.track, course.settings) for course in courses] + [(track, settings) for track in held_out]
    for track, of_it in everywhere:
        plan_objects(track, objects_of(of_it), habits(settings.race.fidelity))


def _groups_of_request(request: RaceRequest) -> dict[str, Any]:
    """Return what job.json says of groups, as it was asked; nothing where there are none."""
    options = {"tracks": request.tracks, "groups": request.groups, "hold_out": request.hold_out}
    return {name: list(value) for name, value in options.items() if value}


def _notes_on_held_out(held_out: Sequence[Track]) -> tuple[str, ...]:
    names = ", ".join(track.name for track in held_out)
    return (f"never trained on, judged at every evaluation: {names}",) if held_out else ()


def _default_stops(request: RaceRequest) -> tuple[str, ...]:
    if request.drfc is not None:
        return ()
    if request.preset == "race":
        return (f"steps={RACE_STEPS}",)
    return STOPS_AGAINST if request.against else DEFAULT_STOPS


def _preset_of(request: RaceRequest, algorithm: Algorithm, overrides: Sequence[str], has_courses: bool) -> str:
    """Return the preset that is asked for, that of the run whose weights are taken, or what goes with the training."""
    if request.preset is not None:
        return request.preset
    source = None if request.clone_from is None else Path(split_source(request.clone_from)[0])
    if source is not None and (source / JOB).is_file():
        return str(RunFolder(source).read_job()["asked"]["preset"])
    several = has_courses or request.tracks or request.groups or request.hold_out or request.against or request.drfc
    others = [one for one in overrides if one.startswith("race.type=") and one != f"race.type={TIME_TRIAL}"]
    return "fast" if several or others or algorithm.name != DEFAULT_ALGORITHM else "race"


def _race_of(request: RaceRequest, told: tuple[str, ...]) -> tuple[str, ...]:
    """Return the type of race that racing others asks for.

    Raises:
        SettingError: Another type was asked for, too.
    """
    wanted = f"race.type={HEAD_TO_MODEL}"
    types = [one for one in (*told, *request.overrides) if one.startswith("race.type=")]
    if request.against and types and types[-1] != wanted and types[-1] != f"race.type={TIME_TRIAL}":
        raise SettingError(
            "--against asks for a race of {head_to_model}, and {types} was asked for, too; expected one of them. "
            "Leave one out.",
            head_to_model=HEAD_TO_MODEL,
            types=types[-1],
        )
    return (wanted,) if request.against else ()


def _load_track(request: RaceRequest, env: RunEnv) -> Track:
    """Load the track; where run.env named it, an error about it names that line."""
    name = _track_of(request)
    try:
        return load_track(name)
    except TrackError as error:
        if env.values.get(TRACK_VARIABLE) != name:
            raise
        found = Message("'{name}': {found}", name=name, found=error.found)
        raise env.error_at(TRACK_VARIABLE, error.expected, error.hint, found) from error


def _require_copies(run: RunFolder) -> None:
    """Refuse to go on without a file the run was begun with: a default in its place would be another training."""
    for copy in (run.reward_function, run.model_metadata, run.hyperparameters):
        if not copy.is_file():
            raise RunFolderError(
                "{copy}: the run's own copy is gone; expected the file it was begun with. Put it back, or begin a new "
                "run from these weights with --from {path}.",
                copy=copy,
                path=run.path,
            )


def _track_of(request: RaceRequest) -> str:
    return request.track or DEFAULT_TRACK


def _source_name(source: str) -> str:
    """Return where weights came from without saying where on this machine it lies: "old-run:best"."""
    path, which = split_source(source)
    return f"{Path(path).resolve().name}:{which}"


def _notes_on_state(reward: RewardSource) -> list[str]:
    """Say what a reward function forgets when its run is resumed; nothing, where it can keep nothing."""
    state = reward.analysis.state
    if state is None:
        return []
    place = f"{reward.path.name}:{state.line}: {state.text}"
    return [f"what the reward function kept between calls starts anew in every car ({place})"]
