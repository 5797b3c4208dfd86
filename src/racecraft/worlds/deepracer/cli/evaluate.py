"""`racecraft evaluate`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.cli.runs.judge import show_episodes
from racecraft.worlds.deepracer.actions.evaluate import EvaluatedDrive, EvaluatedTracks
from racecraft.worlds.deepracer.actions.evaluate import evaluate as action
from racecraft.worlds.deepracer.actions.robustness import SurvivedLaps

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.laps import LapReport
    from racecraft.worlds.deepracer.evaluation.trial_race import RaceRecord
    from racecraft.worlds.deepracer.files.generalisation import TrackResult


def show(done: EvaluatedDrive | Figures) -> None:
    """Print how a run did."""
    if isinstance(done, EvaluatedDrive):
        _show_drive(done)
    elif isinstance(done, EvaluatedTracks):
        _show_tracks(done)
    elif isinstance(done, SurvivedLaps):
        print(f"{done.where}:")
        _print_bars(done["bars"])
        _print_files(done)
    else:
        show_episodes(done)


def _show_drive(done: EvaluatedDrive) -> None:
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs
    from racecraft.worlds.deepracer.evaluation.laps import LapReport

    drive, report = done.drive, done.drive.report
    print(f"{done.run}, checkpoint {drive.car.checkpoint.iteration}, on {drive.track.title or drive.track.name}:")
    if isinstance(report, LapReport):
        _print_laps(report)
        print("\n".join(done.pace.lines() if done.pace else ()))
    else:
        print_race(report)
        if limits := beyond_logs(drive.car.settings.race.car, drive.car.actions.fastest):
            print(limits)
    _print_files(done)


def _print_files(done: EvaluatedDrive | Figures) -> None:
    print_files(done.files)


def _print_laps(report: LapReport) -> None:
    rows = []
    for index, lap in enumerate(report.laps, 1):
        seconds = f"{lap.seconds:.2f}" if lap.seconds is not None else "-"
        rows.append((str(index), seconds, f"{lap.progress_percent:.1f} %", lap.status.replace("_", " ")))
    table(("lap", "seconds", "progress", "ended"), rows, left=("ended",))


def print_race(record: RaceRecord) -> None:
    """Print a row a trial."""
    rows = []
    for one in record.trials:
        seconds = "-" if one.seconds is None else f"{one.seconds:.2f}"
        resets, penalty = str(one.reset_count), f"{one.penalty_seconds:.0f} s"
        ended = one.status.replace("_", " ")
        rows.append((str(one.trial), seconds, f"{one.progress_percent:.1f} %", resets, penalty, ended))
    table(("trial", "seconds", "progress", "resets", "penalty", "ended"), rows, left=("ended",))


def _show_tracks(done: EvaluatedTracks) -> None:
    from racecraft.worlds.deepracer.evaluation.by_track import summary_of

    about = f"{done.car.run.path}, checkpoint {done.car.checkpoint.iteration}"
    print(f"{about}, {done.starts} laps on each of {len(done.results)} tracks:")
    _print_tracks(done.results)
    for role, part in summary_of(done.results).items():
        print(
            f"{role.replace('_', ' ')}: {part['lapped']} of {part['tracks']} lapped from every start, "
            f"{part['full_laps']} of {part['laps']} laps full, mean progress {part['mean_progress_percent']:.1f} %"
        )


def _print_tracks(results: Sequence[TrackResult]) -> None:
    rows = []
    for one in results:
        lap = "-" if one.best_lap_seconds is None else f"{one.best_lap_seconds:.2f} s"
        laps, progress = f"{one.full_laps} of {one.laps}", f"{one.mean_progress_percent:.1f} %"
        rows.append((one.label, one.role.replace("_", " "), laps, progress, lap))
    table(("track", "", "full laps", "mean progress", "best lap"), rows, left=("track", ""))


def _print_bars(bars: list[dict[str, Any]]) -> None:
    rows = []
    for bar in bars:
        ended = max(bar["ended"], key=bar["ended"].get).replace("_", " ")
        interval = f"{100 * bar['full_laps_share_low']:.0f} to {100 * bar['full_laps_share_high']:.0f} %"
        laps, progress = f"{bar['full_laps']}/{bar['tries']}", f"{bar['mean_progress_percent']:.1f} %"
        rows.append((bar["disturbance"], laps, interval, progress, ended))
    titles = ("disturbance", "laps", "95 % of laps", "mean progress", "mostly ended")
    table(titles, rows, left=("disturbance", "mostly ended"))


evaluate = command(action, show, messages_aside=True)
