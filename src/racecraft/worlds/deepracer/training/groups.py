"""Groups of cars as they are typed: which tracks, which races, how many cars. Begin with `requested_groups`.

A group is a few words, `track=Oval_track race=OBJECT_AVOIDANCE boxes.number=3 direction=both cars=8`, or the same as a
dictionary. What it does not say is as in the rest of the training; one that names no track races on every track named.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, SettingError, nearest
from racecraft.formats.json_text import read_json
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.describe import value_text
from racecraft.worlds.deepracer.env.settings import RACE_TYPES, race_groups
from racecraft.worlds.deepracer.players.run_courses import shares
from racecraft.worlds.deepracer.tracks.catalogue import names as catalogue_names
from racecraft.worlds.deepracer.training.courses import Course

WORDS = ("track", "race", "direction", "cars")
"""What a group says beside the settings of its race."""
RACE_GROUPS = ("race", "boxes", "bots")
"""Groups of settings that may differ from one group of cars to the next."""
DIRECTIONS = {"forward": (False,), "reverse": (True,), "both": (False, True)}
"""Whether a track is driven in reverse, by word."""
SHARED = ("race.fidelity", "race.waypoints", "race.reward_seconds")
"""Settings of the race that are one for all."""
OTHER_WORDS = {"race.type": "race=", "race.reverse": "direction="}
ALL = "all"
MAX_CARS = 65536
FEW_CARS = 4
"""Cars on each of many roads, at least."""
EVERY, SHARE = 10, 0.25
"""Iterations between evaluations of many roads, and steps that they may take for each step of training: an untrained
car that drives in a circle is judged until its time is out, on every road."""

Group = str | Mapping[str, Any]
"""As typed, or by word."""


def requested_groups(named: Sequence[str], groups: Sequence[Group]) -> tuple[Course, ...]:
    """Return the courses of a training; none where it is one track and nothing else is said.

    Args:
        named: The tracks that are named, as `track_names` gives them.
        groups: What is said of each group.

    Raises:
        SettingError: A word that no group knows, a race that there is not, no cars, or what is shared by all.
    """
    if not groups:
        return tuple(Course(track=name) for name in named) if len(named) > 1 else ()
    courses: list[Course] = []
    for number, group in enumerate(groups, 1):
        options, place = _words(group, number)
        tracks_of_it: list[str | None] = [options["track"]] if "track" in options else [*named] or [None]
        for track in tracks_of_it:
            courses += _courses(options, track, place)
    return tuple(courses)


def track_names(tracks: Sequence[str], away: Sequence[str] = ()) -> list[str]:
    """Return the names of a list as typed, each once; "all" leaves those `away` out.

    >>> track_names(["Oval_track,Vegas_track", "Oval_track"])
    ['Oval_track', 'Vegas_track']
    """
    found = [name.strip() for part in tracks for name in part.split(",") if name.strip()]
    every = [name for name in catalogue_names() if name not in away] if ALL in found else []
    return list(dict.fromkeys(one for name in found for one in (every if name == ALL else [name])))


def worlds_for(courses: Sequence[Course]) -> tuple[str, ...]:
    """Return settings that so many courses want where nobody says otherwise, as after --set.

    Cars enough that each road has a few, and evaluations rare: they are long.
    """
    if not courses:
        return ()
    counts = [course.cars for course in courses]
    cars = sum(filter(None, counts)) + FEW_CARS * counts.count(None)

    worlds = cars if None not in counts else max(cars, RolloutConfig().num_worlds)
    every = EVERY if len(courses) > FEW_CARS else 1
    return (f"rollout.num_worlds={worlds}", f"evaluation.every={every}", f"evaluation.share={SHARE}")


def read_groups(path: Path) -> tuple[Group, ...]:
    """Return the groups of a file: a JSON list of them, each an object by word or a text.

    Raises:
        InputFileError: It cannot be read.
        SettingError: It is no such list.
    """
    groups = read_json(path, InputFileError, "a JSON list of groups").value
    if not isinstance(groups, list) or not groups or not all(isinstance(one, dict | str) for one in groups):
        raise SettingError(
            '{path}: is no list of groups; expected [{{"track": "Oval_track", "cars": 8}}, …].', path=path
        )
    return tuple(groups)


def _words(group: Group, number: int) -> tuple[dict[str, str], str]:
    """Return a group's words, and what letters call it."""
    if isinstance(group, Mapping):
        options = {}
        for word, value in group.items():
            inner = value if isinstance(value, Mapping) else None
            if inner is None:
                options[str(word)] = _text(value)
            else:
                options |= {f"{word}.{name}": _text(one) for name, one in inner.items()}
        return options, f"group {number}"
    place = f"--group '{group}'"
    options = {}
    for part in shlex.split(group):
        word, equals, value = part.partition("=")
        if not equals:
            raise SettingError(
                "{place}: '{part}' says nothing; expected word=value, such as track=Oval_track cars=8.",
                place=place,
                part=part,
            )
        if word in options:
            raise SettingError("{place}: {word} is said twice; expected it once.", place=place, word=word)
        options[word] = value
    return options, place


def _text(value: Any) -> str:
    return value if isinstance(value, str) else value_text(tuple(value) if isinstance(value, list) else value)


def _courses(options: Mapping[str, str], track: str | None, place: str) -> list[Course]:
    """Return the courses of one group on one track: two where it drives both ways, with half of its cars each."""
    for word in options:
        _require_known(word, place)
    ways = _choice(options, "direction", tuple(DIRECTIONS), place)
    race = _choice(options, "race", RACE_TYPES, place)
    overrides = [f"race.type={race}"] if race else []
    overrides += [f"{word}={value}" for word, value in options.items() if "." in word]
    cars = _cars(options, place)
    _require_race_of(options, race, place)
    course = Course(track=track, overrides=tuple(overrides), location=place, cars=cars)
    if ways is None:
        return [course]
    directions = DIRECTIONS[ways]
    if cars is not None and cars < len(directions):
        raise SettingError("{place}: one car cannot drive both ways; expected cars=2 or more.", place=place)
    parts = [None] * len(directions) if cars is None else shares(cars, len(directions))
    reverse = [f"race.reverse={value_text(way)}" for way in directions]
    return [
        replace(course, overrides=(*course.overrides, way), cars=part) for way, part in zip(reverse, parts, strict=True)
    ]


def _require_known(word: str, place: str) -> None:
    """Refuse a word that is none, and a setting that one network, one car or all groups share."""
    head = word.partition(".")[0]
    if word in OTHER_WORDS:
        raise SettingError(
            "{place}: {word} is not said so; expected {other_words}.",
            place=place,
            word=word,
            other_words=OTHER_WORDS[word],
        )
    if word in SHARED or ("." in word and head not in RACE_GROUPS):
        raise SettingError(
            "{place}: {word} is one for the whole training; expected {words} or a setting of race, boxes "
            "or bots. Say it with --set, for all groups.",
            place=place,
            word=word,
            words=", ".join(WORDS),
        )
    if word in ("sensor", "sensors", "action_space", "actions", "camera"):
        raise SettingError(
            "{place}: {word} belongs to the car, and one network drives every group; expected groups with the same "
            "sensors and actions. Say them in model_metadata.json, for all of them.",
            place=place,
            word=word,
        )
    if "." not in word and word not in WORDS:
        raise SettingError(
            "{place}: a group knows no '{word}'. {hint}", place=place, word=word, hint=nearest(word, WORDS)
        )


def _require_race_of(options: Mapping[str, str], race: str | None, place: str) -> None:
    """Refuse settings of objects that the group's own race does not have; without a race the training's decides."""
    for word in options:
        head = word.partition(".")[0]
        owners = [one for one in RACE_TYPES if head in race_groups(one)]
        if owners and race is not None and race not in owners:
            raise SettingError(
                "{place}: {word} is of a race of {owners}, not of {race}; expected race={owners}.",
                place=place,
                word=word,
                owners=owners[0],
                race=race,
            )


def _choice(options: Mapping[str, str], word: str, known: tuple[str, ...], place: str) -> str | None:
    if word not in options:
        return None
    folded = {one.casefold(): one for one in known}
    found = folded.get(options[word].casefold().replace("-", "_"))
    if found is None:
        raise SettingError(
            "{place}: there is no {word} '{told}'. {hint}",
            place=place,
            word=word,
            told=options[word],
            hint=nearest(options[word], known),
        )
    return found


def _cars(options: Mapping[str, str], place: str) -> int | None:
    if "cars" not in options:
        return None
    text = options["cars"]
    if not (text.isascii() and text.isdigit()) or not 1 <= int(text) <= MAX_CARS:
        raise SettingError(
            "{place}: cars={text}; expected a whole number from 1 to {max_cars}. Leave the group out.",
            place=place,
            text=text,
            max_cars=MAX_CARS,
        )
    return int(text)
