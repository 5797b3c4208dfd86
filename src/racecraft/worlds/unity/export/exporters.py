"""What `racecraft export` writes of a run in Unity, and what it says of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.export.exported import Exported
from racecraft.worlds.unity.export.unity_run import UnityExport, export_to_unity


def export_unity(run: Path, to: str, which: str | None, output: Path | None, check: bool) -> Exported:
    """Write the ONNX files that Unity loads, one a behavior.

    Raises:
        SettingError: They are not to be checked.
    """
    if not check:
        raise SettingError("--no-check says nothing of --to unity, which is always checked; expected it left out.")
    exported = export_to_unity(run, which or "best", output)
    first, *others = [_figures(one) for one in exported]
    lines = []
    for one in exported:
        lines.append(f"{one.path}: {one.behavior}, checkpoint {one.checkpoint}; the ONNX checker is content.")
        lines.append(_told(one))
    lines.append("Copy it into the project's assets and set it as the Model of the agent's Behavior Parameters.")
    return Exported({**first, **({"others": others} if others else {})}, lines)


def _figures(exported: UnityExport) -> dict[str, Any]:
    return {
        "checkpoint": exported.checkpoint,
        "behavior": exported.behavior,
        "file": str(exported.path),
        "checked_on": exported.checked_on,
        "recorded": exported.recorded,
        "largest_difference": exported.largest_difference,
    }


def _told(exported: UnityExport) -> str:
    if exported.checked_on is None:
        return (
            "It was not run: onnxruntime is not installed. To compare it with the checkpoint: pip install onnxruntime"
        )
    kind = "recorded" if exported.recorded else "made-up"
    return (
        f"Run in onnxruntime on {exported.checked_on} {kind} observations: its actions are at most "
        f"{exported.largest_difference:g} away from the checkpoint's."
    )
