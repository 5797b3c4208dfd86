"""What is kept of a drive: the replay, and AWS's trace, log and metrics under the leaderboard's name. See `files_of`.

    drive.safetensors                        actions as they were chosen, and where the car was in every tick
    leaderboard-simtrace/0-iteration.csv     every tick, as AWS's readers want it
    logs/leaderboard/leaderboard.log         the same as lines SIM_TRACE_LOG
    metrics/evaluation/evaluation-N.json     a row a lap
    model_metadata.json                      the car

Of cars that met each other each has these below `car-K/`.
"""

from __future__ import annotations

import datetime
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.run_folder import MODEL_METADATA
from racecraft.formats.tensor_file import read_tensors, write_tensors
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import read_model_metadata
from racecraft.worlds.deepracer.files.simulation_log import log_head, trace_lines
from racecraft.worlds.deepracer.league.drives import ACTIONS, COUNTS, CarDrive
from racecraft.worlds.deepracer.league.replay import KIND, REPLAY
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.training.aws.head_to_head_files import write_aws_heads
from racecraft.worlds.deepracer.training.aws.race_evaluation import write_aws_race

TRACE = "leaderboard-simtrace/0-iteration.csv"
LOG = "logs/leaderboard/leaderboard.log"
REPLAYED = ("front_x", "front_y", "yaw", "driven_speed", "driven_steering", "progress", "lap_seconds", "status", "laps")
"""Columns of TICK_REPORT that a replay shows: m, rad, m/s, rad, %, s, code, count."""


def files_of(drives: Sequence[CarDrive]) -> dict[str, bytes]:
    """Return the files of a heat by their paths."""
    if len(drives) == 1:
        return _files(drives[0])
    return {
        f"car-{number}/{name}": data
        for number, drive in enumerate(drives, start=1)
        for name, data in _files(drive).items()
    }


def recorded_in(folder: Path, cars: int) -> list[dict[str, Array]]:
    """Return the actions of an earlier drive, car by car.

    Raises:
        CheckpointError: The file is missing or damaged.
    """
    places = [folder] if cars == 1 else [folder / f"car-{number}" for number in range(1, cars + 1)]
    found = [read_tensors(place / REPLAY, KIND)[0] for place in places]
    return [{name: arrays[name] for name in (ACTIONS, COUNTS)} for arrays in found]


def _files(drive: CarDrive) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="racecraft-drive-") as name:
        folder = Path(name)
        _write_replay(folder / REPLAY, drive)
        stamp = _write_aws(folder, drive)
        (folder / f"evaluation-{stamp}" / "evaluation-simtrace").rename(folder / "leaderboard-simtrace")
        (folder / f"evaluation-{stamp}").rmdir()
        _write_log(folder / LOG, folder / TRACE, drive)
        if drive.car.run.model_metadata.is_file():
            (folder / MODEL_METADATA).write_bytes(drive.car.run.model_metadata.read_bytes())
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def _write_replay(path: Path, drive: CarDrive) -> None:
    columns = {name: np.ascontiguousarray(drive.ticks[name]) for name in REPLAYED}
    if drive.record is not None:
        columns |= {"trial": drive.record.trial, "pause_seconds": drive.record.pause_seconds}
        if drive.record.objects is not None:
            columns["objects"] = drive.record.objects[0].astype(np.float32)
    card: Mapping[str, Any] = {"track": drive.track.name, "car": drive.car.settings.race.car, "ticks_per_second": 15}
    write_tensors(path, KIND, {**columns, **drive.actions}, card)


def _write_aws(folder: Path, drive: CarDrive) -> str:
    moment = datetime.datetime.now(datetime.UTC)
    if drive.record is not None:
        return write_aws_race(folder, drive.record, drive.track.length, moment)
    return write_aws_heads(folder, drive.ticks, drive.track.length, moment)


def _write_log(path: Path, trace: Path, drive: CarDrive) -> None:
    path.parent.mkdir(parents=True)
    head = []
    if drive.car.run.model_metadata.is_file():
        head = log_head(drive.track.name, read_model_metadata(drive.car.run.model_metadata), Hyperparameters())
    lines = [*head, *trace_lines(read_sim_trace(trace).columns)]
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
