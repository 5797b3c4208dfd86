"""Train the rows one after the other, judge each over whole games, and keep what is finished. Begin with `compare`.

A row is a training command of ours in a process of its own, so that it has the cores it is given and no others; its
run lies in the comparison's folder. Judging comes after the clock has stopped: checkpoints from along the way and the
last one play whole games greedily, every row the same ones. What was judged lies in `<row>.json`; a comparison that was
broken off goes on from there.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.policy import Policy
from racecraft.contract.world import World
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.reproduction import MASKED_RANDOM, RANDOM, Moment, RowResult
from racecraft.formats.run_folder import CHECKPOINTS, JOB, METRICS
from racecraft.formats.whole import make_folder, write_whole
from racecraft.jobs import children
from racecraft.jobs.reproduction.rows import MASKED, PLAIN, WORLDS, Row
from racecraft.players.trained import load_policy
from racecraft.worlds.battlesnake.evaluation.whole_games import RandomMoves, play_whole_games

ASKED, LOGS = "comparison.json", "logs"
MOMENTS = 8
"""Checkpoints of each row that are judged, the last one in."""
SEED_OF_JUDGING = 1_000_000_007
LOOK_SECONDS, SAY_SECONDS, PATIENCE_SECONDS = 0.2, 15.0, 60.0

Result = tuple[RowResult, list[Moment]]
Say = Callable[[str], None]


class ComparisonError(UserInputError):
    """A comparison cannot be made, or not gone on with."""


@dataclass(frozen=True)
class Asked:
    """What is compared."""

    gym: str
    minutes: float
    """Each row trains."""
    games: int
    """Whole games behind each mean."""
    seed: int

    def __post_init__(self) -> None:
        if not 0.01 <= self.minutes <= 1440 or not 2 <= self.games <= 10_000:
            raise SettingError(
                f"--minutes {self.minutes:g}, --games {self.games}; expected 0.01 to 1440 minutes, 2 to 10,000 games."
            )


def compare(folder: Path, asked: Asked, rows: list[Row], say: Say, finished: Callable[[list[Result]], None]) -> None:
    """Make every row that is not yet made.

    Args:
        folder: Where the comparison lies or will lie.
        asked: What is compared.
        rows: What is trained, one after the other.
        say: Says a line to a person.
        finished: Is called with all rows that are finished, floors first, whenever there is one more.

    Raises:
        ComparisonError: Another comparison lies there, or a training failed.
    """
    _begin(folder, asked)
    results = [_floor(folder, asked, name) for name in (RANDOM, MASKED_RANDOM)]
    finished(results)
    for number, row in enumerate(rows, 1):
        if not _kept(folder, row.name).is_file():
            say(f"[{number}/{len(rows)}] {row.name}: {row.title}, {asked.minutes:g} min")
            share = _train(folder, asked, row, say)
            say(f"[{number}/{len(rows)}] {row.name}: judged over {asked.games} games at {MOMENTS} moments")
            _judge(folder, asked, row, share)
        results.append(_read(_kept(folder, row.name)))
        finished(results)


def command_of(row: Row, asked: Asked, run: Path) -> tuple[str, ...]:
    """Return the words behind `racecraft` that train a row."""
    sets = (f"--set={one}" for one in row.settings)
    return (
        "gym", "train", row.world, f"--algorithm={row.algorithm}", *sets, f"--seed={asked.seed}",
        f"--stop=minutes={asked.minutes:g}", f"--run={run}",
    )  # fmt: skip


def usable_cores() -> list[int]:
    """Return the numbers of the cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def _begin(folder: Path, asked: Asked) -> None:
    make_folder(folder)
    path, mine = folder / ASKED, asdict(asked)
    if not path.is_file():
        write_whole(path, json.dumps(mine, indent=2) + "\n")
        return
    there = json.loads(path.read_text(encoding="utf-8"))
    if there != mine:
        told = ", ".join(f"{name} {value}" for name, value in there.items())
        raise ComparisonError(
            f"{folder}: a comparison of {told} lies here; expected the same, to go on with it. Give another --run."
        )


def _train(folder: Path, asked: Asked, row: Row, say: Say) -> float | None:
    """Train a row to its end, in a process of its own; go on with what lies there.

    Returns:
        How much of its cores' time it had, 0 to 1; None where it goes on, or the system does not tell.
    """
    run, log = folder / row.name, folder / LOGS / f"{row.name}.txt"
    make_folder(log.parent)
    spec = JobSpec(
        command=command_of(row, asked, run.absolute()),
        resume=("gym", "train", f"--run={run.absolute()}", "--resume", f"--stop=minutes={asked.minutes:g}"),
        run=str(run.absolute()),
        folder=str(Path.cwd()),
        cores=row.cores,
    )
    goes_on, began, had = run.exists(), time.monotonic(), _processor_seconds()
    with _on_cores(row.cores):
        child = children.start(spec, log)
    try:
        code = _wait(child, run, asked, say)
    except BaseException:
        _let_go(child)
        raise
    if code or not (run / JOB).is_file():
        last = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-3:]
        raise ComparisonError(f"{row.name} ended with {code}; {log} says: {' '.join(last)}")
    if goes_on or had is None:
        return None
    return ((_processor_seconds() or had) - had) / (time.monotonic() - began) / row.cores


def _processor_seconds() -> float | None:
    """Return what all children that have ended had of the processor; None where the system does not tell."""
    if sys.platform == "win32":
        return None
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _wait(child: children.Child, run: Path, asked: Asked, say: Say) -> int:
    said = time.monotonic()
    while (code := child.ended()) is None:
        time.sleep(LOOK_SECONDS)
        if time.monotonic() - said > SAY_SECONDS:
            said = time.monotonic()
            if lines := _metrics(run):
                row = lines[-1]
                say(f"    {row['seconds']:.0f} of {60 * asked.minutes:.0f} s, {row['steps']:,} steps")
    return code


def _let_go(child: children.Child) -> None:
    """End a training as Ctrl-C would, so that it keeps its last whole iteration; at once if it does not hear."""
    with contextlib.suppress(OSError, ValueError):
        child.process.send_signal(signal.SIGINT)
    try:
        child.process.wait(PATIENCE_SECONDS)
    except (subprocess.TimeoutExpired, KeyboardInterrupt):
        child.end()
    child.ended()


@contextlib.contextmanager
def _on_cores(count: int) -> Iterator[None]:
    """Let what is begun meanwhile have the first so many cores; where the system gives none, threads must do."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(sorted(before)[:count]))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _judge(folder: Path, asked: Asked, row: Row, share: float | None) -> None:
    """Let checkpoints from along the way play whole games, and keep what that came to."""
    run = folder / row.name
    lines = {int(one["iteration"]): one for one in _metrics(run)}
    if not lines:
        raise ComparisonError(f"{run}: not one iteration was finished in {asked.minutes:g} min; give more --minutes.")
    shelf = run / CHECKPOINTS
    kept = {entry.iteration for entry in Checkpoints(shelf).entries() if (shelf / entry.policy).is_file()}
    kept &= lines.keys()
    curve = []
    for iteration in _along_the_way(sorted(kept), lines, asked.minutes):
        policy = load_policy(f"{run}:{iteration}")
        curve.append(Moment(lines[iteration]["seconds"] / 60, **_play(asked, row.world, policy)))
    last, end = lines[max(lines)], curve[-1]
    result = RowResult(
        row=row.name, title=row.title, algorithm=row.algorithm, cores=row.cores, minutes=last["seconds"] / 60,
        steps=int(last["steps"]), steps_per_second=last["steps"] / last["seconds"], games=asked.games,
        reward=end.reward, reward_error=end.reward_error, length=end.length, length_error=end.length_error,
        run=row.name, processor_share=None if share is None else round(share, 3),
    )  # fmt: skip
    _keep(folder, result, curve)


def _along_the_way(kept: list[int], lines: dict[int, dict[str, Any]], minutes: float) -> list[int]:
    """Return the kept iterations nearest to evenly spread moments, the last one at the end."""
    seconds = np.array([lines[iteration]["seconds"] for iteration in kept])
    wanted = 60 * minutes * np.arange(1, MOMENTS + 1) / MOMENTS
    nearest = {kept[int(np.abs(seconds - moment).argmin())] for moment in wanted}
    return sorted(nearest | {kept[-1]})


def _floor(folder: Path, asked: Asked, name: str) -> Result:
    """Return what chance alone comes to."""
    if not _kept(folder, name).is_file():
        world = f"{WORLDS}:{(MASKED if name == MASKED_RANDOM else PLAIN)[asked.gym]}"
        figures = _play(asked, world, RandomMoves(asked.seed))
        title = "random among moves that meet no wall and no body" if name == MASKED_RANDOM else "random moves"
        _keep(folder, RowResult(name, title, "", 1, None, None, None, asked.games, **figures, run=""), [])
    return _read(_kept(folder, name))


def _play(asked: Asked, world_name: str, policy: Policy) -> dict[str, float]:
    module, _, name = world_name.partition(":")
    with contextlib.closing(_world(module, name, asked.games)) as world:
        return play_whole_games(policy, world, SEED_OF_JUDGING).told()


def _world(module: str, name: str, games: int) -> World:
    world: World = getattr(importlib.import_module(module), name)(games)
    return world


def _metrics(run: Path) -> list[dict[str, Any]]:
    """Return the lines of a run's metrics; one under way is left out."""
    try:
        lines = (run / METRICS).read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return []
    told = []
    for line in lines:
        try:
            told.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return told


def _kept(folder: Path, row: str) -> Path:
    return folder / f"{row}.json"


def _keep(folder: Path, result: RowResult, curve: list[Moment]) -> None:
    told = {"result": asdict(result), "curve": [asdict(moment) for moment in curve]}
    write_whole(_kept(folder, result.row), json.dumps(told, indent=2) + "\n")


def _read(path: Path) -> Result:
    told = json.loads(path.read_text(encoding="utf-8"))
    return RowResult(**told["result"]), [Moment(**moment) for moment in told["curve"]]
