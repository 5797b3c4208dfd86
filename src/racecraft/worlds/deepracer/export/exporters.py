"""What `racecraft export` writes of a car's run, and what it says of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.export.exported import Exported
from racecraft.worlds.deepracer.export.agreement import Agreement
from racecraft.worlds.deepracer.export.aws_folder import export_to_aws
from racecraft.worlds.deepracer.export.car_model import export_to_car
from racecraft.worlds.deepracer.export.policy_file import export_policy

BEST = "best"


def export_car(run: Path, to: str, which: str | None, output: Path | None, check: bool) -> Exported:
    """Write the archive that a physical car takes."""
    done = export_to_car(run, which or BEST, output, check)
    figures = {
        "checkpoint": done.checkpoint,
        "file": str(done.path),
        "pixels_averaged": done.shrink,
        **_figures(done.agreement),
        "notes": list(done.notes),
    }
    lines = [
        f"{done.path}: checkpoint {done.checkpoint}, a graph as AWS's trainer freezes it.",
        _told(done.agreement, done.shrink),
        *(f"- {note}" for note in done.notes),
        "Upload it in the car's own console (Models, Upload).",
    ]
    return Exported(figures, lines)


def export_file(run: Path, to: str, which: str | None, output: Path | None, check: bool) -> Exported:
    """Write the policy in the format of another runtime."""
    done = export_policy(run, to, which or BEST, output, check)
    figures = {
        "checkpoint": done.checkpoint,
        "files": [str(path) for path in done.paths],
        "pixels_averaged": done.shrink,
        **_figures(done.agreement),
    }
    lines = [
        f"{' and '.join(map(str, done.paths))}: checkpoint {done.checkpoint}.",
        _told(done.agreement, done.shrink),
    ]
    return Exported(figures, lines)


def export_aws(run: Path, to: str, which: str | None, output: Path | None, check: bool) -> Exported:
    """Write a model folder of DeepRacer for Cloud, or of AWS's console."""
    done = export_to_aws(run, to, output, check, which)
    agreement = done.agreement
    figures = {
        "file": str(done.path),
        "checkpoints": list(done.checkpoints),
        "checked_on": agreement.frames if agreement else None,
        "largest_difference": agreement.largest_difference if agreement else None,
    }
    lines = [
        f"{done.path}: {', '.join(done.checkpoints)}, with their frozen graphs.",
        "It was not checked."
        if agreement is None
        else f"Asked beside the checkpoint on {agreement.frames} frames of its own track: every action agrees.",
    ]
    return Exported(figures, lines)


def _figures(agreement: Agreement | None) -> dict[str, Any]:
    return {
        "checked_on": agreement.frames if agreement else None,
        "largest_difference": agreement.largest_difference if agreement else None,
        "small_frames_alike": agreement.small_frames_share if agreement else None,
    }


def _told(agreement: Agreement | None, shrink: int) -> str:
    if agreement is None:
        return "It was not checked."
    text = (
        f"Asked beside the checkpoint on {agreement.frames} frames of its own track: every action agrees, answers lie "
        f"at most {agreement.largest_difference:g} apart."
    )
    if agreement.small_frames_share is None:
        return text
    return (
        f"{text}\nThe file averages {shrink} x {shrink} of the car's 160 x 120 pixels to one; on "
        f"{agreement.small_frames_share:.0%} of the frames it decides as the checkpoint does on the simulator's own "
        "small ones."
    )
