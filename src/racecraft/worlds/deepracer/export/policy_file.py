"""A car's policy in the format of another runtime: ONNX, OpenVINO, TensorFlow Lite. Begin with `export_policy`.

Which packages that takes is the affair of the door that each format has; here is what they have in common.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import SettingError
from racecraft.export.policy_onnx import onnx_answer, onnx_files
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.policy_layers import PolicyLayers
from racecraft.worlds.deepracer.export.agreement import Agreement, Answer, compare
from racecraft.worlds.deepracer.export.car_model import car_layers, metadata_text
from racecraft.worlds.deepracer.export.policy_openvino import openvino_answer, openvino_files
from racecraft.worlds.deepracer.export.policy_tflite import tflite_answer, tflite_files
from racecraft.worlds.deepracer.players.trained_car import load_trained_car


@dataclass(frozen=True)
class PolicyFormat:
    """How a format is written, and asked."""

    end: str
    """Of the file that is named; others lie beside it."""
    files: Callable[[PolicyLayers, str], Mapping[str, bytes]]
    answer: Callable[[PolicyLayers, Mapping[str, bytes]], Answer]


FORMATS: Mapping[str, PolicyFormat] = {
    "onnx": PolicyFormat(".onnx", onnx_files, onnx_answer),
    "openvino": PolicyFormat(".xml", openvino_files, openvino_answer),
    "tflite": PolicyFormat(".tflite", tflite_files, tflite_answer),
}


@dataclass(frozen=True)
class PolicyExport:
    """What was written and how it was checked."""

    paths: tuple[Path, ...]
    """The file that is named, then those beside it."""
    checkpoint: int
    shrink: int
    """How many pixels, across and down, the file averages to one."""
    agreement: Agreement | None
    """None: it was not checked."""


def export_policy(
    run: str | Path, to: str, which: str = "best", output: str | Path | None = None, check: bool = True
) -> PolicyExport:
    """Write the policy of a car's run in the format of another runtime.

    Args:
        run: The run folder of `racecraft train`.
        to: One of `FORMATS`.
        which: "best", "last" or the number of an iteration.
        output: A file with the format's end, or a folder; None for `<run>/export`.
        check: Whether the written file and the checkpoint are asked side by side first.

    Raises:
        RunFolderError: No run folder, or the run of another kind of world.
        CheckpointError: No such checkpoint.
        NoPlainLayersError: The policy is made of more than convolutions and dense layers.
        MissingExtraError: A package is missing; the message says how to install it.
        ExportError: The file does not act as the checkpoint does; nothing is written.
    """
    form = FORMATS[to]
    car = load_trained_car(run, which)
    place = _place(Path(output) if output is not None else car.run.path / "export", form.end)
    policy = car_layers(car)
    files = form.files(policy, metadata_text(car))
    agreement = compare(car, policy, form.answer(policy, files)) if check else None
    make_folder(place.parent)
    for end in sorted(files, key=lambda end: end == form.end):  # the one that names the others comes last
        write_atomic(place.with_suffix(end), files[end])
    beside = tuple(place.with_suffix(end) for end in files if end != form.end)
    return PolicyExport((place, *beside), car.checkpoint.iteration, policy.network.shrink, agreement)


def _place(output: Path, end: str) -> Path:
    """Return the file that is to be written.

    Raises:
        SettingError: Its name ends otherwise.
    """
    if output.is_dir() or not output.suffix:
        return output / f"policy{end}"
    if output.suffix != end:
        raise SettingError(
            "--output {output}: expected a file that ends in {end}, or a folder.", output=output, end=end
        )
    return output
