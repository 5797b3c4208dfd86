"""Reels: what cars did tick by tick, as plain values that a page can play. Begin with `iteration_playback`.

A reel is T ticks of C cars side by side, from what a training left a moment ago (`live_playback`), from a kept
iteration (`iteration_playback`) or of one kept episode (`episode_playback`), which may run over several iterations.
All have one shape::

    {"ticks": T, "cars": [{"name": "7", "world": 7, "agent": 0, "x": [T], "y": [T], "yaw": [T], …}], "endings": […]}

Metres, radians, m/s; progress in per cent. A car that stands parked has null for x. Besides, `objects` says where boxes
and bots stand: by world, from which tick on they stand so, `{"7": [[0, [[x, y, yaw], …]], …]}`; runs that were trained
before episode files told it have none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.formats.episodes import STATUSES, read_episodes
from racecraft.formats.live_ticks import OBJECTS, read_live_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.tracks.track import Track

CHANNELS = {
    "x": ("x_m", 3, 1.0),
    "y": ("y_m", 3, 1.0),
    "yaw": ("yaw_rad", 3, 1.0),
    "speed": ("velocity_mps", 2, 1.0),
    "told": ("speed_mps", 2, 1.0),
    "steering": ("steering_rad", 3, 1.0),
    "progress": ("progress_share", 2, 100.0),
    "reward": ("reward", 3, 1.0),
    "episode": ("episode", 0, 1.0),
    "tick": ("tick", 0, 1.0),
}
"""What a reel tells of a car in a tick: the column of episode files, decimals kept, factor."""
COLUMNS = (*(column for column, _, _ in CHANNELS.values()), "done", "status", "world")
MARGIN_M = 0.4
PARKED = STATUSES.index("park")


class ReelError(UserInputError):
    """There is nothing kept of what is asked for."""


def track_shape(track: Track) -> dict[str, Any]:
    """Return a circuit to be drawn: lines in metres, what is painted on it, its own colours as CSS."""
    look = track.look
    return {
        "name": track.name,
        "title": track.title or track.name,
        "length": round(track.length, 3),
        "closed": track.closed,
        **{side: np.round(getattr(track, side), 3).tolist() for side in ("centre", "inner", "outer")},
        "bounds": _surroundings(track),
        "line_width": look.line_width,
        "colours": {
            name: "#{:02x}{:02x}{:02x}".format(*getattr(look, name)) for name in ("field", "road", "line", "dash")
        },
    }


def _surroundings(track: Track) -> list[float]:
    """Return west, south, east and north of what is worth seeing, m: the road and a little of the field."""
    rows = np.concatenate([track.outer, track.inner])
    (west, south), (east, north) = rows.min(axis=0) - MARGIN_M, rows.max(axis=0) + MARGIN_M
    return [round(float(edge), 3) for edge in (west, south, east, north)]


def live_playback(run: RunFolder, after: int, agents: int = 1) -> dict[str, Any] | None:
    """Return what a training has left just now behind tick number `after`; None where that is nothing.

    `first` and `last` tell whether there is a gap before them. A number that no tick has yet is of an earlier training
    in this folder: its reader gets what there is.
    """
    live = read_live_ticks(run)
    if live is None or live.last == after or not live.are_live:
        return None
    after = after if after < live.last else 0
    ticks = len(live.columns["x_m"])
    skipped = max(0, after - (live.last - ticks))
    columns = {name: array[skipped:] for name, array in live.columns.items()}
    cars = columns["x_m"].shape[1]
    places = [divmod(car, agents) for car in range(cars)]
    reel = _reel(columns, places, agents)
    header = {"first": live.last - ticks + skipped + 1, "last": live.last, "written": live.written}
    return {**header, **reel, "objects": _objects(columns)}


def _objects(columns: Mapping[str, Array]) -> dict[str, list[list[Any]]]:
    """Return where the boxes and bots of each world stand, and from which tick on: what stands still is told once."""
    objects: dict[str, list[list[Any]]] = {}
    for name in (name for name in columns if name.startswith(OBJECTS)):
        first = int(name[len(OBJECTS) :])
        for world in range(columns[name].shape[1]):
            objects[str(first + world)] = _stands(columns[name][:, world])
    return objects


def _stands(places: Array) -> list[list[Any]]:
    """Return from which ticks on objects stand where, of places (T, K, 3); nan ones are not there."""
    there = ~np.isnan(places[0, :, 0])
    places = np.round(places[:, there].astype(np.float64), 3)
    moved = np.ones(len(places), bool)
    moved[1:] = (places[1:] != places[:-1]).any(axis=(1, 2))
    return [[int(tick), places[tick].tolist()] for tick in np.flatnonzero(moved)] if there.any() else []


def kept_iterations(run: RunFolder) -> list[int]:
    """Return the iterations whose ticks are kept, rising."""
    named = (re.fullmatch(r"(\d+)\.parquet", path.name) for path in run.episodes.glob("*.parquet"))
    return sorted(int(match[1]) for match in named if match)


def iteration_playback(run: RunFolder, iteration: int) -> dict[str, Any]:
    """Return an iteration: its ticks, and its `episodes` as `episodes_in` tells them.

    Raises:
        EpisodeFileError: There is no such iteration, or its file is damaged.
    """
    table = _table(run.episodes / f"{iteration}.parquet")
    cars = _cars(table)
    starts = np.flatnonzero(np.append(True, cars[1:] != cars[:-1]))
    lengths = np.diff(np.append(starts, len(cars)))
    row, car = np.arange(len(cars)) - np.repeat(starts, lengths), np.repeat(np.arange(len(starts)), lengths)
    columns = {}
    for name, values in table.items():
        if name == "objects":
            continue
        whole = np.full((lengths.max(), len(starts)), PARKED if name == "status" else 0, values.dtype)
        whole[row, car] = values
        columns[name] = whole
    places = [(int(table["world"][start]), int(table["agent"][start])) for start in starts]
    agents = int(table["agent"].max()) + 1
    return {
        "iteration": iteration,
        **_reel(columns, places, agents),
        "objects": _kept_objects(table, starts, lengths),
        "episodes": episodes_in(table, starts, agents),
    }


def _kept_objects(table: Mapping[str, Array], starts: Array, lengths: Array) -> dict[str, list[list[Any]]]:
    """Return where the objects of each world stood, by its first car's rows; nothing where the file does not tell."""
    if "objects" not in table:
        return {}
    return {
        str(table["world"][start]): _stands(table["objects"][start : start + length])
        for start, length in zip(starts, lengths, strict=True)
        if table["agent"][start] == 0
    }


def episodes_in(table: Mapping[str, Array], starts: Array, agents: int) -> list[dict[str, Any]]:
    """Return the parts of episodes in an iteration, a row each.

    `from` and `to` are rows of the reel; `whole` tells that it began and ended in this iteration.
    """
    cars, episode = _cars(table), table["episode"]
    begins = np.flatnonzero(np.append(True, (cars[1:] != cars[:-1]) | (episode[1:] != episode[:-1])))
    ends = np.append(begins[1:], len(cars)) - 1
    first = starts[np.searchsorted(starts, begins, "right") - 1]
    rewards = np.add.reduceat(table["reward"], begins)
    return [
        {
            "car": _name(int(table["world"][begin]), int(table["agent"][begin]), agents),
            "world": int(table["world"][begin]),
            "agent": int(table["agent"][begin]),
            "episode": int(episode[begin]),
            "from": int(begin - zero),
            "to": int(end - zero),
            "progress": round(100.0 * float(table["progress_share"][end]), 1),
            "reward": round(float(paid), 2),
            "steps": int(table["tick"][end]),
            "status": STATUSES[table["status"][end]] if table["done"][end] else "in_progress",
            "whole": bool(table["tick"][begin] == 1 and table["done"][end]),
        }
        for begin, end, zero, paid in zip(begins, ends, first, rewards, strict=True)
    ]


def episode_playback(run: RunFolder, iteration: int, world: int, agent: int, episode: int) -> dict[str, Any]:
    """Return a whole kept episode, of which a part lies in `iteration`: the iterations around it are asked as well.

    Raises:
        ReelError: There is no such episode in that iteration.
        EpisodeFileError: A file is missing or damaged.
    """
    wanted = (world, agent, episode)
    parts = [_part(run, iteration, *wanted)]
    if not len(parts[0]["tick"]):
        raise ReelError(
            "{path}: iteration {iteration} has no episode {episode} of car {name}; expected one that its list names.",
            path=run.path,
            iteration=iteration,
            episode=episode,
            name=_name(world, agent, 2),
        )
    before = iteration
    while parts[0]["tick"][0] > 1 and (run.episodes / f"{before - 1}.parquet").is_file():
        before -= 1
        parts.insert(0, _part(run, before, *wanted))
        if not len(parts[0]["tick"]):
            break
    behind = iteration
    while not parts[-1]["done"][-1:].any() and (run.episodes / f"{behind + 1}.parquet").is_file():
        behind += 1
        parts.append(_part(run, behind, *wanted))
        if not len(parts[-1]["tick"]):
            break
    columns = {name: np.concatenate([part[name] for part in parts])[:, None] for name in parts[0]}
    places = columns.pop("objects", None)
    objects = {} if places is None else {str(world): _stands(places[:, 0])}
    return {"iteration": iteration, **_reel(columns, [(world, agent)], 2 if agent else 1), "objects": objects}


def _part(run: RunFolder, iteration: int, world: int, agent: int, episode: int) -> dict[str, Array]:
    table = _table(run.episodes / f"{iteration}.parquet")
    rows = (table["world"] == world) & (table["agent"] == agent) & (table["episode"] == episode)
    return {name: values[rows] for name, values in table.items()}


def _table(path: Path) -> dict[str, Array]:
    """Return a file's columns; the status as a code, the agent 0 where every world has one car, objects (R, K, 3)."""
    frame = read_episodes(path)
    table = {name: frame[name].to_numpy() for name in COLUMNS if name != "status"}
    codes = {word: code for code, word in enumerate(STATUSES)}
    table["status"] = frame["status"].replace_strict(codes, default=codes["in_progress"]).to_numpy().astype(np.uint8)
    if "objects" in frame.columns:
        table["objects"] = frame["objects"].struct.unnest().to_numpy().reshape(len(frame), -1, 3)
    table["agent"] = frame["agent"].to_numpy() if "agent" in frame.columns else np.zeros(len(frame), np.int32)
    return table


def _cars(table: Mapping[str, Array]) -> Array:
    return table["world"] * (int(table["agent"].max(initial=0)) + 1) + table["agent"]


def _name(world: int, agent: int, agents: int) -> str:
    """Return what a car is called: its world's number, and its own where a world has several.

    >>> _name(7, 0, 1), _name(7, 1, 2)
    ('7', '7.1')
    """
    return str(world) if agents == 1 else f"{world}.{agent}"


def _reel(columns: Mapping[str, Array], places: Sequence[tuple[int, int]], agents: int) -> dict[str, Any]:
    """Return a reel of columns (T, C); `places` are the world and the agent of each car."""
    reel = {
        key: np.round(columns[column].astype(np.float64) * factor, decimals)
        for key, (column, decimals, factor) in CHANNELS.items()
    }
    whole = {key for key, (_, decimals, _) in CHANNELS.items() if decimals == 0}
    parked = columns["status"] == PARKED
    cars = []
    for car, (world, agent) in enumerate(places):
        one: dict[str, Any] = {"name": _name(world, agent, agents), "world": world, "agent": agent}
        for key, values in reel.items():
            column = values[:, car]
            one[key] = (column.astype(np.int64) if key in whole else column).tolist()
        for tick in np.flatnonzero(parked[:, car]).tolist():
            one["x"][tick] = None
        cars.append(one)
    ended = np.argwhere(columns["done"] & ~parked)
    endings = [
        {"tick": int(tick), "car": int(car), "status": STATUSES[columns["status"][tick, car]]} for tick, car in ended
    ]
    return {"ticks": len(parked), "cars": cars, "endings": endings}
