"""Live ticks of cars that workers drive: a whole rollout at a time, as soon as it has come. See `RemoteLiveTicks`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.episodes import STATUSES
from racecraft.formats.live_ticks import OBJECTS, latest_request, write_live_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.training.run_writer import Columns

TOLD = {
    "x_m": "f4",
    "y_m": "f4",
    "yaw_rad": "f4",
    "velocity_mps": "f4",
    "speed_mps": "f4",
    "steering_rad": "f4",
    "progress_share": "f4",
    "reward": "f4",
    "episode": "i4",
    "tick": "i4",
    "done": "?",
}
"""Columns of episode files that live ticks have, too, and how they are left."""
CODES = {word: code for code, word in enumerate(STATUSES)}


class RemoteLiveTicks:
    """Leaves a rollout that came from workers, where somebody wishes for ticks when it comes.

    Args:
        run: The run folder.
    """

    def __init__(self, run: RunFolder) -> None:
        self._run = run
        self._last = 0
        """Number of the last tick that came."""
        self._answered: int | None = None

    def __call__(self, parts: Sequence[Columns]) -> None:
        """Hear of one rollout.

        Args:
            parts: Each worker's ticks as the columns of `formats/episodes.py`, worlds numbered through.
        """
        self._last += max(int(_cars_of(part)[1].max()) for part in parts)
        wish = latest_request(self._run)
        if wish is None or wish == self._answered:
            return
        self._answered = wish
        write_live_ticks(self._run, self._last, _side_by_side([_as_live(part) for part in parts]))


def _cars_of(part: Columns) -> tuple[Array, Array]:
    """Return in which row each car's ticks begin, and how many they are."""
    agents = part.get("agent", np.zeros(len(part["world"]), int))
    news = (part["world"][1:] != part["world"][:-1]) | (agents[1:] != agents[:-1])
    begins = np.flatnonzero(np.append(True, news))
    return begins, np.diff(np.append(begins, len(agents)))


def _as_live(part: Columns) -> Columns:
    """Return one worker's ticks (T, C); a car that was parked before the others stands there parked at the end."""
    begins, counts = _cars_of(part)
    ticks = np.minimum(np.arange(counts.max())[:, None], counts - 1)
    rows, is_parked = begins + ticks, np.arange(counts.max())[:, None] >= counts
    live = {name: part[name].astype(kind)[rows] for name, kind in TOLD.items()}
    codes = np.array([CODES[word] for word in part["status"].tolist()], np.uint8)
    live["status"] = np.where(is_parked, np.uint8(CODES["park"]), codes[rows])
    live["done"] &= ~is_parked
    if "objects" in part:
        first_cars = np.append(True, np.diff(part["world"][begins]) != 0)
        places = np.ascontiguousarray(part["objects"]).view(np.float32).reshape(len(part["world"]), -1, 3)
        live[f"{OBJECTS}{part['world'][0]}"] = places[rows[:, first_cars]]
    return live


def _side_by_side(parts: Sequence[Columns]) -> Columns:
    """Return the cars of all workers side by side; objects stay apart, under the number of their first world."""
    ticks = max(len(part["done"]) for part in parts)
    padded = [{name: _to_the_end(array, ticks) for name, array in part.items()} for part in parts]
    for part, whole in zip(parts, padded, strict=True):
        whole["status"][len(part["done"]) :] = CODES["park"]
        whole["done"][len(part["done"]) :] = False
    joined = {
        name: np.ascontiguousarray(np.concatenate([part[name] for part in padded], axis=1))
        for name in (*TOLD, "status")
    }
    return joined | {name: array for part in padded for name, array in part.items() if name.startswith(OBJECTS)}


def _to_the_end(array: Array, ticks: int) -> Array:
    """Return so many ticks, the last of them repeated (a copy)."""
    whole: Array = np.ascontiguousarray(array[np.minimum(np.arange(ticks), len(array) - 1)])
    return whole
