"""`racecraft export`: hand a trained policy over to another program, or to a car."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.named_run import RUN_HELP, named_run
from racecraft.contract.errors import SettingError, nearest

if TYPE_CHECKING:
    from racecraft.export.policy_file import PolicyExport
    from racecraft.worlds.deepracer.export.car_model import CarExport
    from racecraft.worlds.unity.export.unity_run import UnityExport

FILES = ("onnx", "openvino", "tflite")
TARGETS = ("unity", "car", "drfc", "console", *FILES)
BEST = "best"


def export(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    to: Annotated[str, typer.Option(help=f"Whom it is for: {', '.join(TARGETS)}.")],
    checkpoint: Annotated[
        str | None,
        typer.Option(help="best, last, an iteration's number, or a merit such as laptime; by default the best."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(help="A file, or a folder; by default in RUN/export."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check/--no-check", help="Ask checkpoint and exported file side by side before writing.")
    ] = True,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Write a trained policy as a file that another program loads, and check that it acts alike.

    Examples:

        racecraft export runs/Basic-1 --to unity

        racecraft export runs/reinvent_base-1 --to car

        racecraft export runs/aws-1 --to drfc --output bucket/rl-deepracer-mine

        racecraft export runs/reinvent_base-1:laptime --to onnx --output policy.onnx
    """
    if to not in TARGETS:
        raise SettingError(f"--to {to!r} is not known. {nearest(to, TARGETS)}")
    export_run(*named_run(run, checkpoint), to, output, check, json)


def export_run(
    run: Path, which: str | None, to: str, output: Path | None, check: bool = True, json: bool = False
) -> None:
    """Export a checkpoint of a run, None: the best, and say what was written."""
    if to in ("drfc", "console"):
        _export_aws(run, to, which, output, check, json)
        return
    which = which or BEST
    if to == "car":
        _export_car(run, which, output, check, json)
        return
    if to in FILES:
        _export_file(run, to, which, output, check, json)
        return
    if not check:
        raise SettingError("--no-check says nothing of --to unity, which is always checked; expected it left out.")
    _export_unity(run, which, output, json)


def _export_car(run: Path, checkpoint: str, output: Path | None, check: bool, json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.export.car_model import export_to_car

    exported = export_to_car(run, checkpoint, output, check)
    if json:
        print_json({"run": str(run), "to": "car", **_car_figures(exported)})
        return
    print(f"{exported.path}: checkpoint {exported.checkpoint}, a graph as AWS's trainer freezes it.")
    print(_told_of_car(exported))
    for note in exported.notes:
        print(f"- {note}")
    print("Upload it in the car's own console (Models, Upload).")


def _car_figures(exported: CarExport) -> dict[str, Any]:
    agreement = exported.agreement
    return {
        "checkpoint": exported.checkpoint,
        "file": str(exported.path),
        "pixels_averaged": exported.shrink,
        "checked_on": agreement.frames if agreement else None,
        "largest_difference": agreement.largest_difference if agreement else None,
        "small_frames_alike": agreement.small_frames_share if agreement else None,
        "notes": list(exported.notes),
    }


def _export_file(run: Path, to: str, checkpoint: str, output: Path | None, check: bool, json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.export.policy_file import export_policy

    exported = export_policy(run, to, checkpoint, output, check)
    agreement = exported.agreement
    if json:
        print_json({"run": str(run), "to": to, "checkpoint": exported.checkpoint,
                    "files": [str(path) for path in exported.paths], "pixels_averaged": exported.shrink,
                    "checked_on": agreement.frames if agreement else None,
                    "largest_difference": agreement.largest_difference if agreement else None,
                    "small_frames_alike": agreement.small_frames_share if agreement else None})  # fmt: skip
        return
    print(f"{' and '.join(map(str, exported.paths))}: checkpoint {exported.checkpoint}.")
    print(_told_of_car(exported))


def _told_of_car(exported: CarExport | PolicyExport) -> str:
    agreement = exported.agreement
    if agreement is None:
        return "It was not checked."
    told = (
        f"Asked beside the checkpoint on {agreement.frames} frames of its own track: every action agrees, answers lie "
        f"at most {agreement.largest_difference:g} apart."
    )
    if agreement.small_frames_share is None:
        return told
    return (
        f"{told}\nThe file averages {exported.shrink} x {exported.shrink} of the car's 160 x 120 pixels to one; on "
        f"{agreement.small_frames_share:.0%} of the frames it decides as the checkpoint does on the simulator's own "
        "small ones."
    )


def _export_aws(run: Path, to: str, which: str | None, output: Path | None, check: bool, json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.export.aws_folder import export_to_aws

    done = export_to_aws(run, to, output, check, which)
    agreement = done.agreement
    if json:
        print_json({"run": str(run), "to": to, "file": str(done.path), "checkpoints": list(done.checkpoints),
                    "checked_on": agreement.frames if agreement else None,
                    "largest_difference": agreement.largest_difference if agreement else None})  # fmt: skip
        return
    print(f"{done.path}: {', '.join(done.checkpoints)}, with their frozen graphs.")
    print(
        "It was not checked."
        if agreement is None
        else f"Asked beside the checkpoint on {agreement.frames} frames of its own track: every action agrees."
    )


def _export_unity(run: Path, checkpoint: str, output: Path | None, json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.worlds.unity.export.unity_run import export_to_unity

    exported = export_to_unity(run, checkpoint, output)
    if json:
        first, *others = [_figures(one) for one in exported]
        print_json({"run": str(run), "to": "unity", **first, **({"others": others} if others else {})})
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
