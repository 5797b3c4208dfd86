"""What a report tells of, read once from a run folder. Begin with `read_facts`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.analysis.advice import Advice
from racecraft.analysis.own_plots import NoPlot
from racecraft.analysis.plot import Plot
from racecraft.contract.errors import TrackError, UserInputError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis import tables
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.failure_places import Why
from racecraft.worlds.deepracer.files.generalisation import TrackResult, read_generalisation
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

MOST_TICKS = 2_000_000
"""Ticks read for the tables; of a longer run the latest."""

SCORES = {
    "deepracer": ("progress (% of a lap)", "best checkpoint, mean progress"),
    "battlesnake": ("rating (Elo)", "best checkpoint, rating"),
}
RETURN = ("return (sum of rewards)", "best checkpoint, mean return")
"""What a run's scores and that of its best checkpoint are called, by its kind; RETURN is of all other kinds."""


class ReportError(UserInputError):
    """A report cannot be written of what the folder holds."""


@dataclass(frozen=True)
class RunFacts:
    """What a run folder tells, read once."""

    name: str
    job: dict[str, Any]
    metrics: list[dict[str, Any]]
    evaluations: list[dict[str, Any]]
    ticks: pl.DataFrame
    laps: pl.DataFrame
    track: Track | None
    """None where the run has none, or it is not the track of that name here."""
    drive: Drive | None = None
    """What the best policy drove, if somebody let it."""
    film: bytes | None = None
    """The same as a small film, an MP4."""
    best: int | None = None
    """Iteration of the best checkpoint, once one was evaluated."""
    reward: str = ""
    """The reward function's own text; "" where the run has none."""
    advice: Sequence[Advice] = ()
    """What to try next, computed from the run."""
    own: Sequence[Plot | NoPlot] = ()
    """The racer's own plots, and why there are none where they failed."""
    by_track: tuple[int, tuple[TrackResult, ...]] | None = None
    """The latest evaluation track by track, and its iteration, where there are several."""
    path: str = "RUN"
    """What a command calls the run."""
    why: Why | None = None
    """Where its best policy fails, and what would have saved it."""

    @property
    def best_row(self) -> dict[str, Any]:
        """The metrics of the best checkpoint's iteration; empty before any was evaluated."""
        return next((row for row in self.metrics if row.get("iteration") == self.best), {})

    @property
    def is_race(self) -> bool:
        """Cars were trained; scores are progress."""
        return self.kind == "deepracer"

    @property
    def kind(self) -> str:
        """What was trained, as job.json calls it."""
        return str(self.job.get("kind", "deepracer"))

    @property
    def score_name(self) -> str:
        """What the scores are, with their unit."""
        return SCORES.get(self.kind, RETURN)[0]

    @property
    def best_score_name(self) -> str:
        """What the best of them is called."""
        return SCORES.get(self.kind, RETURN)[1]

    @property
    def title(self) -> str:
        """The headline: the circuit, what else was trained, or the run's name."""
        return self.track.title or self.track.name if self.track else str(self.job.get("title", self.name))


def read_facts(run: RunFolder, drive: Drive | None = None, film: bytes | None = None) -> RunFacts:
    """Read what a report tells of; `drive` is the lap to show, `film` shows it.

    Raises:
        ReportError: An evaluation is damaged.
        RunFolderError, EpisodeFileError: Another file is damaged.
    """
    job = run.read_job()
    ticks = tables.load_episodes(run, MOST_TICKS)
    return RunFacts(
        name=run.path.resolve().name,
        job=job,
        metrics=run.read_metrics(),
        evaluations=list(_read_evaluations(run)),
        ticks=ticks,
        laps=ticks if ticks.is_empty() else tables.laps_table(ticks),
        track=_track_of(job),
        drive=drive,
        film=film,
        best=_best_of(run),
        reward=_reward_of(run),
        by_track=read_generalisation(run.generalisation),
    )


def _best_of(run: RunFolder) -> int | None:
    """Return the iteration of the checkpoint that the run calls best; None before any was evaluated."""
    checkpoints = Checkpoints(run.checkpoints)
    if not any(entry.score is not None for entry in checkpoints.entries()):
        return None
    return checkpoints.find("best").iteration


def _reward_of(run: RunFolder) -> str:
    """Return the text of the reward function, as far as it is text."""
    if not run.reward_function.is_file():
        return ""
    return run.reward_function.read_text(encoding="utf-8", errors="replace")


def _read_evaluations(run: RunFolder) -> Iterator[dict[str, Any]]:
    """Yield the evaluations by iteration."""
    paths = [path for path in run.evaluations.glob("*.json") if path.stem.isdigit()]
    for path in sorted(paths, key=lambda one: int(one.stem)):
        try:
            evaluation = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ReportError(
                f"{path}: cannot be read ({error}); expected an evaluation. Take the file out."
            ) from error
        if isinstance(evaluation, dict):
            yield {"iteration": int(path.stem), **evaluation}


def _track_of(job: Mapping[str, Any]) -> Track | None:
    """Return the circuit as it was driven, if it can be found and is the same."""
    told = job.get("track") or {}
    for name in (told.get("name"), (job.get("asked") or {}).get("track")):
        try:
            track = load_track(name) if name else None
        except TrackError:
            continue
        if track is not None and told.get("hash") in (None, track.hash()):
            is_reversed = job.get("settings", {}).get("race", {}).get("reverse", False)
            return track.reversed() if is_reversed else track
    return None
