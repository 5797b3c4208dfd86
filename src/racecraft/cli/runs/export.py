"""`racecraft export`: hand a trained policy over to another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.contract.errors import SettingError, nearest

if TYPE_CHECKING:
    from racecraft.export.unity_run import UnityExport

TARGETS = ("unity",)


def export(
    run: Annotated[Path, typer.Argument(help="A run folder, such as runs/Basic-1.")],
    to: Annotated[str, typer.Option(help=f"Whom it is for: {', '.join(TARGETS)}.")],
    checkpoint: Annotated[str, typer.Option(help="best, last, or the number of an iteration.")] = "best",
    output: Annotated[
        Path | None, typer.Option(help="A file, or a folder; by default RUN/export/BEHAVIOR.onnx.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Write a trained policy as a file that another program loads, and check that it acts alike.

    Example: racecraft export runs/Basic-1 --to unity
    """
    from racecraft.cli.output import print_json

    if to not in TARGETS:
        raise SettingError(f"--to {to!r} is not known. {nearest(to, TARGETS)}")
    from racecraft.export.unity_run import export_to_unity

    exported = export_to_unity(run, checkpoint, output)
    if json:
        first, *others = [_figures(one) for one in exported]
        print_json({"run": str(run), "to": to, **first, **({"others": others} if others else {})})
        return
    for one in exported:
        print(f"{one.path}: {one.behavior}, checkpoint {one.checkpoint}; the ONNX checker is content.")
        print(_told(one))
    print("Copy it into the project's assets and set it as the Model of the agent's Behavior Parameters.")


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
