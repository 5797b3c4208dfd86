"""What the run.env of a racer's folder means for a training. Begin with `race_environment`.

It says nothing about what is not in the file, so that the command line, then run.env, then the preset decide. What is
valid and not built yet is refused where training something else would be wrong (another race), and otherwise named.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from racecraft.contract.errors import SettingError
from racecraft.envs.deepracer.settings import RACE_TYPES, TIME_TRIAL
from racecraft.formats.aws.run_env import RunEnv, read_env_folder
from racecraft.formats.aws.run_env_variables import BY_NAME
from racecraft.training.deepracer.race_objects import belongs_to, objects_overrides
from racecraft.training.stopping import parse_stops

FILE = "run.env"
TRACK_VARIABLE = "DR_WORLD_NAME"
BEST_METRICS = ("progress", "reward", "laptime")
USED = tuple(name for name, variable in BY_NAME.items() if variable.status == "used")
"""Variables that are obeyed here."""

_DEFAULT_PART = re.compile(r"\$(DR_[A-Z0-9_]+?)(?=$|[^A-Z0-9_])")
"""Another variable in a default, such as $DR_CAR_NAME."""
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
    judging: Mapping[str, int | str] = field(default_factory=dict)
    """What `racecraft evaluate` does with the run where it is not told otherwise: "laps", "checkpoint"."""
    files: Path | None = None
    """Where the racer's three files lie instead of the folder itself."""
    notes: tuple[str, ...] = ()
    """What is worth telling the user, a clause each."""


def race_environment(folder: Path | None, clones: bool = True) -> RaceEnvironment:
    """Read run.env (and system.env before it, where there is one) from a racer's folder.

    Args:
        folder: The racer's folder; None: there is none.
        clones: Whether it may say what training begins with; False where that was said elsewhere.

    Raises:
        RunEnvError: A line or value cannot be used; the letter names file, line and variable.
    """
    if folder is None or not (folder / FILE).is_file():
        return RaceEnvironment()
    whole = read_env_folder(folder)
    env = whole.run
    race = _race_type(env)
    return RaceEnvironment(
        env=env,
        track=env.values.get(TRACK_VARIABLE),
        overrides=(*_overrides(env), *objects_overrides(env, race)),
        start_offset=_share(env, "DR_TRAIN_START_POSITION_OFFSET"),
        stops=_stops(env),
        clone_from=_clone_source(env, folder) if clones else None,
        judging=_judging(env),
        files=_files(env, folder),
        notes=(*env.notes, *_unused_notes(env, race, bool(whole.workers))),
    )


def _race_type(env: RunEnv) -> str:
    """Return the race; one that is not built yet is refused: training another one instead would be no favour."""
    race = env.choice("DR_RACE_TYPE", TIME_TRIAL, (*RACE_TYPES, "HEAD_TO_MODEL"))
    if race not in RACE_TYPES:
        cure = "Change this variable, or wait for a later version."
        raise env.letter("DR_RACE_TYPE", " or ".join(RACE_TYPES), cure, found=f"'{race}' is valid and not built yet")
    return race


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
    if (trials := _trials(env, "DR_TRAIN_MIN_EVAL_TRIALS")) is not None:
        found.append(f"evaluation.episodes={trials}")
    if "DR_TRAIN_BEST_MODEL_METRIC" in env.values:
        found.append(f"evaluation.best_by={env.choice('DR_TRAIN_BEST_MODEL_METRIC', 'progress', BEST_METRICS)}")
    return tuple(found)


def _judging(env: RunEnv) -> dict[str, int | str]:
    """Return what an evaluation of the run does where it is not told otherwise."""
    found: dict[str, int | str] = {}
    if (laps := _trials(env, "DR_EVAL_NUMBER_OF_TRIALS")) is not None:
        found["laps"] = laps
    if "DR_EVAL_CHECKPOINT" in env.values:
        found["checkpoint"] = env.choice("DR_EVAL_CHECKPOINT", "last", ("last", "best"))
    return found


def _trials(env: RunEnv, name: str) -> int | None:
    if name not in env.values:
        return None
    trials = env.number(name, 1, 1, 1000)
    if trials != int(trials):
        raise env.letter(name, "a whole number from 1 to 1000")
    return int(trials)


def _share(env: RunEnv, name: str) -> float | None:
    return env.number(name, 0.0, 0.0, 1.0) if name in env.values else None


def _word(flag: bool) -> str:
    return "true" if flag else "false"


def _stops(env: RunEnv) -> tuple[str, ...]:
    stops = tuple(env.text("RACECRAFT_STOP").replace(",", " ").split())
    try:
        parse_stops(stops)
    except SettingError as error:
        raise env.letter("RACECRAFT_STOP", "stops such as laps minutes=30", str(error)) from error
    return stops


def _clone_source(env: RunEnv, folder: Path) -> str | None:
    """Return the older run that training begins with: a path, a name beside the folder or below runs/."""
    if not env.flag("DR_LOCAL_S3_PRETRAINED"):
        return None
    name = "DR_LOCAL_S3_PRETRAINED_PREFIX"
    which = env.choice("DR_LOCAL_S3_PRETRAINED_CHECKPOINT", "last", ("last", "best"))
    written = env.text(name) or BY_NAME[name].default
    prefix = written.removeprefix("s3://").partition("/")[2] if written.startswith("s3://") else written
    for place in (Path(prefix), folder / prefix, folder.parent / prefix, Path(_SHELF) / prefix):
        if prefix and place.is_dir():
            return f"{place}:{which}"
    place_of = name if name in env.values else "DR_LOCAL_S3_PRETRAINED"
    raise env.letter(
        place_of,
        f"the run folder of an older training: a path, or a name here, beside {folder} or below {_SHELF}/",
        "Say where it lies, or set DR_LOCAL_S3_PRETRAINED=False.",
        found=f"there is no folder '{written}'",
    )


def _files(env: RunEnv, folder: Path) -> Path | None:
    """Return the folder of custom files, where DeepRacer for Cloud keeps the racer's three."""
    name = "DR_LOCAL_S3_CUSTOM_FILES_PREFIX"
    place = folder / env.text(name, BY_NAME[name].default)
    return place if place != folder and place.is_dir() else None


def _unused_notes(env: RunEnv, race: str, has_workers: bool) -> list[str]:
    """Name every known variable that asks for something else than its default and changes nothing here."""
    used = [name for name in USED if belongs_to(name, race)]
    unused = [name for name in env.values if name in BY_NAME and name not in used and not _is_default(env, name)]
    notes = [f"{FILE}: kept and not used yet: {', '.join(unused)}"] if unused else []
    if has_workers:
        notes.append("worker-N.env: kept and not used yet; every car races as run.env says")
    return notes


def _is_default(env: RunEnv, name: str) -> bool:
    """Tell whether a variable says what it would have been anyway; 5 is 5.0 and true is True."""
    default = _DEFAULT_PART.sub(lambda part: env.text(part[1]) or BY_NAME[part[1]].default, BY_NAME[name].default)
    written = env.values[name]
    try:
        return float(written) == float(default)
    except ValueError:
        return written.casefold() == default.casefold()
