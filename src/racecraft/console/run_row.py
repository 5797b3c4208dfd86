"""One run read into one row of the index. Begin with `read_run`."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.console.parts import Card, parts_of
from racecraft.contract.errors import RacecraftError
from racecraft.contract.kinds import find_kind
from racecraft.formats.checkpoint import IMPORTED
from racecraft.formats.run_folder import JOB, METRICS, RunFolder, last_stops
from racecraft.formats.run_lock import LOCK

CURVE_POINTS = 40
"""Points of a curve in a list."""


@dataclass(frozen=True, kw_only=True)
class RunRow:
    """What a list needs to know of a run."""

    path: str
    mark: str
    """Changes with the run's files; see `run_mark`."""
    kind: str = ""
    algorithm: str = ""
    place: str = ""
    picture: str = ""
    about: str = ""
    rank: float | None = None
    best_text: str = ""
    gap_percent: float | None = None
    curve: tuple[float, ...] = ()
    """Scores between 0 and 1, at most CURVE_POINTS."""
    iterations: int = 0
    steps: int = 0
    is_imported: bool = False
    """Another program trained it: it drives, and has no iterations here."""
    seconds: float = 0.0
    """Time trained."""
    speed: float | None = None
    """Steps a second of the last iteration."""
    stops: tuple[str, ...] = ()
    changed: float = 0.0
    """Seconds since 1970."""
    fault: str = ""
    """Why it cannot be read; "": it can."""


def run_mark(run: Path) -> str:
    """Return what changes whenever a run's row would; "" where its files are gone."""
    marks = []
    for name in (JOB, METRICS, LOCK):
        with contextlib.suppress(OSError):
            status = (run / name).stat()
            marks.append(f"{status.st_mtime_ns}.{status.st_size}")
    return "-".join(marks)


def read_run(path: Path, mark: str) -> RunRow:
    """Read a run; one that cannot be read has a row that says why."""
    changed = _changed(path)
    try:
        run = RunFolder(path)
        job, metrics = run.read_job(), run.read_metrics()
        card = parts_of(str(job.get("kind"))).card(run, job, metrics)
    except RacecraftError as error:
        return RunRow(path=str(path), mark=mark, changed=changed, fault=str(error))
    last = metrics[-1] if metrics else {}
    return RunRow(
        path=str(path),
        mark=mark,
        kind=str(job["kind"]),
        algorithm=str(job.get("algorithm", "")),
        curve=_curve(str(job["kind"]), metrics),
        iterations=int(last.get("iteration") or 0),
        is_imported=IMPORTED in job,
        steps=int(last.get("steps") or 0),
        seconds=float(last.get("seconds") or 0.0),
        speed=last.get("steps_per_second"),
        stops=last_stops(job),
        changed=changed,
        **_shown(card),
    )


def _shown(card: Card) -> dict[str, Any]:
    return {name: getattr(card, name) for name in ("place", "picture", "about", "rank", "best_text", "gap_percent")}


def _changed(path: Path) -> float:
    for name in (METRICS, JOB):
        with contextlib.suppress(OSError):
            return (path / name).stat().st_mtime
    return 0.0


def _curve(kind: str, metrics: list[dict[str, Any]]) -> tuple[float, ...]:
    """Return the training's scores, scaled to the world's range or to their own."""
    scores = [float(row["training_score"]) for row in metrics if row.get("training_score") is not None]
    step = max(1, -(-len(scores) // CURVE_POINTS))
    thinned = scores[::-1][::step][::-1]
    if not thinned:
        return ()
    score = find_kind(kind).score
    low = min(thinned) if score.lowest is None else score.lowest
    high = max(thinned) if score.highest is None else score.highest
    return tuple(round(min(max((one - low) / ((high - low) or 1.0), 0.0), 1.0), 3) for one in thinned)
