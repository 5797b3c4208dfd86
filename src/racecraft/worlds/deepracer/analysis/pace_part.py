"""How fast a car became: the part of a report, and the earlier lap that a film shows as a ghost. See `pace_parts`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from racecraft.analysis.page_part import PagePart
from racecraft.analysis.run_facts import RunFacts
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.tensor_file import CheckpointError
from racecraft.pages.parts import card, paragraph, table
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps
from racecraft.worlds.deepracer.driving.known_laps import best_known_lap, direction_of, gap_percent
from racecraft.worlds.deepracer.driving.smoothness import Smoothness, smoothness_of_commands
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.vehicle import beyond_logs
from racecraft.worlds.deepracer.evaluation.laps import LapReport
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.players.trained_car import TrainedCar, load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track

GHOSTS_TRIED = 8
"""Policies that are tried for the first full lap."""


def pace_parts(facts: RunFacts, track: Track, drive: Drive | None) -> Iterator[PagePart]:
    """Yield the first full lap and the fastest, their difference, the gap to the best known lap, and the steering.

    Args:
        facts: Of the run.
        track: What it was trained on.
        drive: Of the best policy; None: nothing is said of its steering.
    """
    laps = [row["best_lap_seconds"] for row in facts.metrics if row.get("best_lap_seconds")]
    if not laps:
        return
    first, best = laps[0], min(laps)
    flying = min((row["flying_lap_seconds"] for row in facts.metrics if row.get("flying_lap_seconds")), default=None)
    race, fastest = facts.job["settings"]["race"], _fastest_command(facts.job)
    car = race["car"]
    known = best_known_lap(track.name, car, fastest, direction_of(race.get("reverse", False)))
    rows = [
        ("first full lap, from rest", f"{first:.2f} s"),
        ("fastest lap, from rest", f"{best:.2f} s"),
        ("faster by", f"{first - best:.2f} s"),
        ("fastest flying lap", "–" if flying is None else f"{flying:.2f} s"),
        ("best known lap", "–" if known is None else f"{known:.2f} s"),
        ("gap", "–" if known is None or flying is None else f"{gap_percent(flying, known):+.1f} %"),
    ]
    pieces = [table(("in evaluations", "value"), rows, (1,))]
    calm = None if drive is None else _steering(drive)
    if calm is not None:
        pieces.append(paragraph(f"The best policy: {calm}."))
    if limits := beyond_logs(car, fastest):
        pieces.append(paragraph(limits, "quiet"))
    yield PagePart("How fast it became", [card(*pieces)])


def first_full_lap(run: RunFolder, best: TrainedCar) -> Drive | None:
    """Return a lap of the first policy that laps from the start line; None without one before the best policy.

    Only the first GHOSTS_TRIED evaluations with a full lap are tried: they may have lapped from elsewhere alone.
    """
    lapping = [row["iteration"] for row in run.read_metrics() if row.get("best_lap_seconds")]
    for iteration in lapping[:GHOSTS_TRIED]:
        if iteration >= best.checkpoint.iteration:
            return None
        try:
            car = load_trained_car(run.path, str(iteration))
        except CheckpointError:  # of a long training, checkpoints between are not kept
            continue
        drive = drive_laps(car, car.trained_on, laps=1)
        if isinstance(drive.report, LapReport) and drive.report.all_full:
            return drive.film_drive
    return None


def _fastest_command(job: Mapping[str, Any]) -> float:
    """Return the fastest command of the run's car, m/s; 0 of a run that does not say what it can be told."""
    metadata = job.get("model_metadata")
    return action_space(action_space_from_aws(metadata["action_space"])).fastest if metadata else 0.0


def _steering(drive: Drive) -> Smoothness | None:
    driven = drive.status != "prepare"
    return smoothness_of_commands(drive.steering_rad, driven[1:] & driven[:-1] & (np.diff(drive.lap) == 0))
