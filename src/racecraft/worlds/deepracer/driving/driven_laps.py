"""The laps that a person drove, kept in one file of demonstrations. Begin with `DrivenLaps`.

The file is what `--set bc.demonstrations=FILE` and `--from FILE` take: an episode a lap. Its `source` says of each lap
how long it took, when it was driven, and where the car was at every tick.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.atomic import make_folder
from racecraft.formats.demonstrations import (
    Demonstrations,
    join_demonstrations,
    read_demonstrations,
    write_demonstrations,
)
from racecraft.formats.tensor_file import CheckpointError
from racecraft.worlds.deepracer.driving.by_hand import HandLap


@dataclass(frozen=True, eq=False)
class DrivenLap:
    """What the file says of a lap."""

    seconds: float
    is_flying: bool
    driven: float
    """Seconds since 1970."""
    path: Array
    """(T, 3) x, y (m) and yaw (rad) of base_link, 15 times a second."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return plain values, lengths to a tenth of a millimetre."""
        path = np.round(self.path, 4).tolist()
        return {"seconds": self.seconds, "flying": self.is_flying, "driven": self.driven, "path": path}


class DrivenLaps:
    """The laps of one file; several drivers may add to it from several threads.

    Args:
        path: The file; made with the first lap.
        track: Name of the track, for people.

    Raises:
        CheckpointError: The file is damaged, or holds something else.
    """

    def __init__(self, path: Path, track: str) -> None:
        self.path, self._track, self._lock = path, track, threading.Lock()
        self._shown: list[Demonstrations] = []
        self._laps: list[DrivenLap] = []
        if path.is_file():
            whole = read_demonstrations(path)
            self._laps = _laps_of(path, whole)
            self._shown = [_episode(whole, number) for number in range(whole.num_episodes)]

    @property
    def laps(self) -> list[DrivenLap]:
        """Every lap, the oldest first."""
        return list(self._laps)

    @property
    def best(self) -> DrivenLap | None:
        """The fastest lap; None: there is none."""
        return min(self._laps, key=lambda lap: lap.seconds, default=None)

    def add(self, lap: HandLap) -> None:
        """Keep a lap.

        Raises:
            SettingError: The file's laps were driven with other actions or sensors.
            OutputFileError: The file cannot be written.
        """
        with self._lock:
            if self._shown and self._shown[0].spec != lap.shown.spec:
                raise SettingError(
                    "{path}: its laps were driven with other actions or another camera; expected those of this car. "
                    "Move the file away.",
                    path=self.path,
                )
            self._write(
                [*self._shown, lap.shown],
                [*self._laps, DrivenLap(round(lap.seconds, 4), lap.is_flying, round(lap.driven, 1), lap.path)],
            )

    def drop(self, number: int) -> None:
        """Forget a lap, counted from 0; the file goes with the last one.

        Raises:
            SettingError: There is no such lap.
            OutputFileError: The file cannot be written.
        """
        with self._lock:
            if not 0 <= number < len(self._laps):
                raise SettingError(
                    "lap {number}: there are {count} laps; expected one of them.",
                    number=number + 1,
                    count=len(self._laps),
                )
            keep = [row for row in range(len(self._laps)) if row != number]
            self._write([self._shown[row] for row in keep], [self._laps[row] for row in keep])

    def _write(self, demonstrations: list[Demonstrations], laps: list[DrivenLap]) -> None:
        if demonstrations:
            make_folder(self.path.parent)
            source = {"by": "hand", "track": self._track, "laps": [lap.as_dictionary() for lap in laps]}
            write_demonstrations(self.path, join_demonstrations(demonstrations, source))
        else:
            self.path.unlink(missing_ok=True)
        self._shown, self._laps = demonstrations, laps


def _episode(whole: Demonstrations, number: int) -> Demonstrations:
    """Return one episode by itself."""
    rows = slice(*np.searchsorted(whole.episode, [number, number + 1]))
    return Demonstrations(
        observations={name: array[rows] for name, array in whole.observations.items()},
        actions=whole.actions[rows],
        reward=whole.reward[rows],
        episode=np.zeros(rows.stop - rows.start, np.int32),
        spec=whole.spec,
        action_mask=None if whole.action_mask is None else whole.action_mask[rows],
        source=whole.source,
    )


def _laps_of(path: Path, whole: Demonstrations) -> list[DrivenLap]:
    """Return what the file says of its laps."""
    try:
        laps = [
            DrivenLap(
                float(one["seconds"]),
                bool(one["flying"]),
                float(one["driven"]),
                np.array(one["path"], float).reshape(-1, 3),
            )
            for one in whole.source["laps"]
        ]
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(path, "no list of laps", "a file that `racecraft drive` wrote") from error
    if len(laps) != whole.num_episodes:
        raise CheckpointError(
            path,
            Message("{count} laps of {episodes} episodes", count=len(laps), episodes=whole.num_episodes),
            "one for each",
        )
    return laps
