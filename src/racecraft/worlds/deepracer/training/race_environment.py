"""What the run.env of a racer's folder means for a training. Begin with `race_environment`.

It says nothing about what is not in the file, so that the command line, then run.env, then the preset decide. What is
valid and not built yet is refused where training something else would be wrong (another race), and otherwise named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from racecraft.contract.errors import Faults, SettingError, nearest
from racecraft.contract.message import Message
from racecraft.formats.run_folder import HYPERPARAMETERS
from racecraft.training.stopping import parse_stops
from racecraft.worlds.deepracer.analysis.films.shells import COLOURS, SHELLS
from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL, RACE_TYPES, TIME_TRIAL
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder, default_text
from racecraft.worlds.deepracer.files.racer_files import METADATA, REWARD
from racecraft.worlds.deepracer.files.run_env import EnvFolder, RunEnv, RunEnvError, read_env_folder
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME, NOT_APPLICABLE, USED
from racecraft.worlds.deepracer.training.courses import Course, requested_courses, workers_asked
from racecraft.worlds.deepracer.training.race_objects import belongs_to, objects_overrides
from racecraft.worlds.deepracer.training.race_rules import requested_judging, whole_number

FILE = "run.env"
TRACK_VARIABLE = "DR_WORLD_NAME"
BEST_METRICS = ("progress", "reward", "laptime")
LOOKS = {"DR_CAR_BODY_SHELL_TYPE": SHELLS, "DR_CAR_COLOR": tuple(COLOURS)}
"""What films are asked about a car."""
OBEYED = tuple(name for name, variable in BY_NAME.items() if variable.status == USED)
"""Variables that are obeyed here."""
KEYS = {
    REWARD: "DR_LOCAL_S3_REWARD_KEY",
    METADATA: "DR_LOCAL_S3_MODEL_METADATA_KEY",
    HYPERPARAMETERS: "DR_LOCAL_S3_HYPERPARAMETERS_KEY",
}
"""The racer's three files, and the variable that names each."""

_SHELF = "runs"
"""Folder in which a model prefix is looked for as well."""


@dataclass(frozen=True)
class RaceEnvironment:
    """What was asked for in run.env; what it does not say is None or empty."""

    env: RunEnv = field(default_factory=RunEnv)
    """All that was read, for whoever writes it down again."""
    track: str | None = None
    """A name of the catalogue, or a waypoint file."""
    overrides: tuple[str, ...] = ()
    """group.name=value, as after --set; what the user typed goes behind them."""
    start_offset: float | None = None
    """Where on the lap the first start lies, 0 to 1."""
    stops: tuple[str, ...] = ()
    """As after --stop."""
    clone_from: str | None = None
    """RUN:best or RUN:last, as after --from."""
    judging: Mapping[str, bool | int | float | str] = field(default_factory=dict)
    """What `racecraft evaluate` does with the run where it is not told otherwise, as `race_rules.py` names it."""
    files: Path | None = None
    """Where the racer's three files lie instead of the folder itself."""
    keys: Mapping[str, Path] = field(default_factory=dict)
    """Files that were named one by one, by the name they have in KEYS."""
    courses: tuple[Course, ...] = ()
    """Where cars of one training drive differently; empty: all as the rest says."""
    notes: tuple[str, ...] = ()
    """What is worth telling the user, a clause each."""


def race_environment(folder: Path | None, clones: bool = True, drfc: DrfcFolder | None = None) -> RaceEnvironment:
    """Read run.env (and system.env before it, where there is one) from a racer's folder.

    Args:
        folder: The racer's folder; None: there is none.
        clones: Whether it may say what training begins with; False where that was said elsewhere.
        drfc: The installation, where a dr- verb has read it; its bucket is then where files and models are looked for.

    Raises:
        RunEnvError: A line or value cannot be used; the message names file, line and variable.
        SeveralFaultsError: Several cannot.
    """
    environment, faults = read_race_environment(folder, clones, drfc)
    faults.raise_found()
    return environment


def read_race_environment(
    folder: Path | None, clones: bool = True, drfc: DrfcFolder | None = None
) -> tuple[RaceEnvironment, Faults]:
    """Read as `race_environment` does; return what holds without the lines that cannot be used, and their faults."""
    faults = Faults()
    if drfc is None and (folder is None or not (folder / FILE).is_file()):
        return RaceEnvironment(), faults
    with faults.collect():
        whole = read_env_folder(folder or ".", faults) if drfc is None else drfc.env
        place = drfc.path if drfc is not None else folder or Path(".")
        while True:  # ends: each turn leaves a value out, or is the last
            try:
                return _environment_of(whole, place, clones, drfc), faults
            except RunEnvError as error:
                if any(str(error) == str(found) for found in faults.found):
                    break  # of a folder that is read by itself, whatever is left out here
                faults.found.append(error)
                whole = whole.without(error)
    return RaceEnvironment(), faults


def _environment_of(whole: EnvFolder, place: Path, clones: bool, drfc: DrfcFolder | None) -> RaceEnvironment:
    """Return what all settings mean together; the first value that cannot be used is refused."""
    env = whole.run
    race = race_type(env)
    _require_looks(env)
    return RaceEnvironment(
        env=env,
        track=env.values.get(TRACK_VARIABLE),
        overrides=(*_overrides(env), *objects_overrides(env, race)),
        start_offset=_share(env, "DR_TRAIN_START_POSITION_OFFSET"),
        stops=_stops(env),
        clone_from=_clone_source(env, place, drfc) if clones else None,
        judging=requested_judging(env),
        files=_files(env, place) if drfc is None else None,
        keys=_keys_in_folder(env, place) if drfc is None else keys_in_bucket(drfc),
        courses=_courses(whole),
        notes=(*env.notes, *_notes_of_workers(whole), *_notes_on_keys(drfc), *_unused_notes(env, race)),
    )


def _require_looks(env: RunEnv) -> None:
    """Refuse now, and not at the first film, a body that no car has."""
    for name, known in LOOKS.items():
        written = env.text(name)
        if written and written.casefold() not in {one.casefold() for one in known}:
            raise env.error_at(name, "one that the original had", nearest(written, known))


def race_type(env: RunEnv) -> str:
    """Return the race."""
    return env.choice("DR_RACE_TYPE", TIME_TRIAL, RACE_TYPES)


def _overrides(env: RunEnv) -> tuple[str, ...]:
    """Return the settings that variables stand for."""
    found = []
    if "DR_TRAIN_REVERSE_DIRECTION" in env.values:
        found.append(f"race.reverse={_word(env.flag('DR_TRAIN_REVERSE_DIRECTION'))}")
    if "DR_TRAIN_CHANGE_START_POSITION" in env.values:
        found.append(f"race.change_start={_word(env.flag('DR_TRAIN_CHANGE_START_POSITION'))}")
    advance = _share(env, "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST")
    if advance is not None:
        found.append(f"race.start_advance={advance:g}")
    if "DR_TRAIN_MIN_EVAL_TRIALS" in env.values:
        found.append(f"evaluation.episodes={whole_number(env, 'DR_TRAIN_MIN_EVAL_TRIALS', 1, 1000)}")
    if "DR_TRAIN_BEST_MODEL_METRIC" in env.values:
        found.append(f"evaluation.best_by={env.choice('DR_TRAIN_BEST_MODEL_METRIC', 'progress', BEST_METRICS)}")
    if "DR_ENABLE_DOMAIN_RANDOMIZATION" in env.values:
        is_on = env.flag("DR_ENABLE_DOMAIN_RANDOMIZATION")
        found += ["variation.level=aws"] if is_on else ["variation.lamps=false", "variation.object_colours=false"]
    return (*found, *_own_settings(env))


def _own_settings(env: RunEnv) -> list[str]:
    """Return what RACECRAFT_SET asks for; each must be name=value."""
    written = env.text("RACECRAFT_SET").split()
    for one in written:
        if "=" not in one or "." not in one.partition("=")[0]:
            raise env.error_at(
                "RACECRAFT_SET", "settings such as runtime.threads=2 ppo.clip=0.1", found=Message("'{one}'", one=one)
            )
    return written


def _share(env: RunEnv, name: str) -> float | None:
    return env.number(name, 0.0, 0.0, 1.0) if name in env.values else None


def _word(flag: bool) -> str:
    return "true" if flag else "false"


def _stops(env: RunEnv) -> tuple[str, ...]:
    stops = tuple(env.text("RACECRAFT_STOP").replace(",", " ").split())
    try:
        parse_stops(stops)
    except SettingError as error:
        raise env.error_at("RACECRAFT_STOP", "stops such as laps minutes=30", str(error)) from error
    return stops


def _clone_source(env: RunEnv, folder: Path, drfc: DrfcFolder | None) -> str | None:
    """Return the older run that training begins with: a prefix of the bucket, a path, a name beside or below runs/."""
    if not env.flag("DR_LOCAL_S3_PRETRAINED"):
        return None
    name = "DR_LOCAL_S3_PRETRAINED_PREFIX"
    which = env.choice("DR_LOCAL_S3_PRETRAINED_CHECKPOINT", "last", ("last", "best"))
    written = env.text(name) or BY_NAME[name].default
    prefix = written.removeprefix("s3://").partition("/")[2] if written.startswith("s3://") else written
    places = [Path(prefix), folder / prefix, folder.parent / prefix, Path(_SHELF) / prefix]
    for place in ([] if drfc is None else [drfc.bucket / prefix]) + places:
        if prefix and place.is_dir():
            return f"{place}:{which}"
    place_of = name if name in env.values else "DR_LOCAL_S3_PRETRAINED"
    bucket = "" if drfc is None else f"a prefix in {drfc.bucket}, "
    raise env.error_at(
        place_of,
        Message(
            "the run folder of an older training: {bucket}a path, or a name here, beside {folder} or below {shelf}/",
            bucket=bucket,
            folder=folder,
            shelf=_SHELF,
        ),
        "Say where it lies, or set DR_LOCAL_S3_PRETRAINED=False.",
        found=Message("there is no folder '{written}'", written=written),
    )


def _files(env: RunEnv, folder: Path) -> Path | None:
    """Return the folder of custom files, where DeepRacer for Cloud keeps the racer's three."""
    name = "DR_LOCAL_S3_CUSTOM_FILES_PREFIX"
    place = folder / env.text(name, BY_NAME[name].default)
    return place if place != folder and place.is_dir() else None


def _keys_in_folder(env: RunEnv, folder: Path) -> dict[str, Path]:
    """Return the files that the keys name otherwise than the prefix of custom files does."""
    named = {file: name for file, name in KEYS.items() if name in env.values and not _is_default(env, name)}
    return {file: _existing(env, name, folder / env.values[name], "") for file, name in named.items()}


def keys_in_bucket(drfc: DrfcFolder) -> dict[str, Path]:
    """Return the three files in the bucket.

    Raises:
        RunEnvError: One is not there; dr-upload-custom-files has not brought it.
    """
    found = {}
    for file, name in KEYS.items():
        place = drfc.key(name)
        if not place.is_file():
            hint = "dr-upload-custom-files copies custom_files there."
            raise drfc.error_at(
                name,
                Message("the file {file} in the bucket", file=file),
                hint,
                found=Message("there is no file {place}", place=place),
            )
        found[file] = place
    return found


def _notes_on_keys(drfc: DrfcFolder | None) -> list[str]:
    """Say where a file is not read from the folder that dr-upload-custom-files fills."""
    if drfc is None:
        return []
    prefix = drfc.text("DR_LOCAL_S3_CUSTOM_FILES_PREFIX").rstrip("/")
    others = [name for name in KEYS.values() if not drfc.text(name).startswith(f"{prefix}/")]
    return [f"{name}={drfc.text(name)} lies outside DR_LOCAL_S3_CUSTOM_FILES_PREFIX={prefix}" for name in others]


def _existing(env: RunEnv, name: str, place: Path, hint: str) -> Path:
    if not place.is_file():
        raise env.error_at(
            name, "a file of the racer's folder", hint, found=Message("there is no file {place}", place=place)
        )
    return place


def _courses(whole: EnvFolder) -> tuple[Course, ...]:
    """Return the courses of worker files and of both directions; none where every car drives the same."""
    return requested_courses(whole, TRACK_VARIABLE, lambda env: _course_overrides(env, whole.run))


def _course_overrides(env: RunEnv, run: RunEnv) -> tuple[str, ...]:
    """Return the settings of a worker's race; what its file does not say is as in run.env."""
    race = race_type(env if "DR_RACE_TYPE" in env.values else run)
    if race == HEAD_TO_MODEL and "DR_RACE_TYPE" in env.values:
        hint = "Race against others in a training of its own."
        others = " or ".join(one for one in RACE_TYPES if one != HEAD_TO_MODEL)
        raise env.error_at("DR_RACE_TYPE", others, hint, found=Message("'{race}' races on one course only", race=race))
    offset = _share(env, "DR_TRAIN_START_POSITION_OFFSET")
    starts = () if offset is None else (f"race.start_offset={offset}",)
    own = tuple(one for one in _overrides(env) if one.startswith(("race.", "variation.")))
    return (f"race.type={race}", *starts, *own, *objects_overrides(env, race))


def _notes_of_workers(whole: EnvFolder) -> list[str]:
    """Say what was noticed in worker files that count, and name what does not."""
    if not whole.run.flag("DR_TRAIN_MULTI_CONFIG"):
        written = whole.run.values.get("DR_WORKERS", "1")
        unused = [f"DR_WORKERS={written}"] * (written != "1") + ["worker-N.env"] * bool(whole.workers)
        reason = "not used, as DR_TRAIN_MULTI_CONFIG is not True; every car races as run.env says"
        return [f"{one}: {reason}; cars side by side are rollout.num_worlds" for one in unused]
    asked = workers_asked(whole.run)
    beyond = [
        f"worker-{number}.env: not driven, as DR_WORKERS is {asked}" for number in whole.workers if number > asked
    ]
    return beyond + [note for number, worker in whole.workers.items() if number <= asked for note in worker.notes]


def _unused_notes(env: RunEnv, race: str) -> list[str]:
    """Name every variable that asks for something else than its default and changes nothing here."""

    def named(status: str) -> str:
        names = (name for name in env.values if name in BY_NAME and BY_NAME[name].status == status)
        return ", ".join(name for name in names if not _is_default(env, name))

    others = [name for name in env.values if not belongs_to(name, race) and not _is_default(env, name)]
    without = named(NOT_APPLICABLE)
    notes = [f"{FILE}: kept, and of another race than {race}: {', '.join(others)}"] if others else []
    return notes + ([f"{FILE}: not applicable here: {without}; `racecraft settings FOLDER` says why"] * bool(without))


def _is_default(env: RunEnv, name: str) -> bool:
    """Tell whether a variable says what it would have been anyway; 5 is 5.0 and true is True."""
    default, written = default_text(name, env), env.values[name]
    try:
        return float(written) == float(default)
    except ValueError:
        return written.casefold() == default.casefold()
