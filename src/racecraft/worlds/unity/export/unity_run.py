"""From a run folder to the ONNX file that Unity loads, checked. Begin with `export_to_unity`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.algorithms.multi_policy import of_member
from racecraft.contract.errors import MissingExtraError, RacecraftError, SettingError
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import load_state
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.worlds.unity.env.behavior_specs import behaviors_in
from racecraft.worlds.unity.env.behaviors import Behavior
from racecraft.worlds.unity.export.unity_model import UnityPolicy, check_unity_model, unity_model, write_unity_model

KIND = "unity"
OBSERVATIONS = "observations.safetensors"
TOLERANCE = 1e-4
"""How far the file's actions may be from the checkpoint's: float32, sums in another order."""
MADE_UP_ROWS = 64


class ExportError(RacecraftError):
    """A model does not act as its checkpoint does; no file is written."""


@dataclass(frozen=True)
class UnityExport:
    """A written file and how it was checked."""

    path: Path
    behavior: str
    checkpoint: int
    checked_on: int | None
    """Rows compared with the checkpoint in onnxruntime; None where that is not installed."""
    recorded: bool
    """Whether those rows are what the policy saw while it was judged; else made up."""
    largest_difference: float | None
    """Of any action in any row."""


def export_to_unity(path: str | Path, which: str = "best", output: str | Path | None = None) -> tuple[UnityExport, ...]:
    """Write the policies of a run as ONNX files for Unity, one a behavior.

    Args:
        path: The run folder of `racecraft unity train`.
        which: "best", "last" or the number of an iteration.
        output: A file that ends in .onnx, or a folder; None for `<run>/export`.

    Raises:
        RunFolderError: No run folder, or the run of another kind of world.
        CheckpointError: No such checkpoint.
        MissingExtraError: onnx is not installed.
        SettingError: One file is named for several behaviors.
        ExportError: A model does not act as the checkpoint does; nothing is written.
    """
    run = RunFolder.open(path)
    run.read_job_of(KIND)  # only what was trained in Unity knows the sensors that Unity will show it
    trained = load_policy(run, which)
    behaviors = behaviors_in(trained.metadata)
    if len(behaviors) > 1 and output is not None and Path(output).suffix == ".onnx":
        raise SettingError(
            "{output}: one file cannot hold {behaviors}; expected a folder for --output.",
            output=output,
            behaviors=", ".join(behaviors),
        )
    file = run.path / OBSERVATIONS
    recorded = load_state(file) if file.exists() else {}
    checked = []
    for base, (behavior, _) in behaviors.items():
        several = len(behaviors) > 1
        policy = _actor(trained.policy.members[base] if several else trained.policy, path, base)
        checked.append(_check(path, behavior, policy, of_member(recorded, base) if several else recorded))
    return tuple(
        UnityExport(
            write_unity_model(output or run.path / "export", policy, behavior),
            behavior.base_name,
            trained.checkpoint.iteration,
            rows,
            was_recorded,
            difference,
        )
        for behavior, policy, rows, was_recorded, difference in checked
    )


def can_export_to_unity(path: str | Path) -> bool:
    """Return whether Unity can load what the latest checkpoint of a run decides with; a group asks its first member."""
    policy = load_policy(RunFolder.open(path), "last").policy
    return isinstance(next(iter(getattr(policy, "members", {"": policy}).values())), UnityPolicy)


def _actor(policy: Any, path: str | Path, base: str) -> UnityPolicy:
    if not isinstance(policy, UnityPolicy):
        raise SettingError(
            "{path}: the policy of '{base}' is a {type_name}; expected one of ppo, sac, dqn or apex "
            "without a memory, which Unity can load: what a memory carries has no place in the files written here.",
            path=path,
            base=base,
            type_name=type(policy).__name__,
        )
    return policy


def _check(
    path: str | Path, behavior: Behavior, policy: UnityPolicy, recorded: Mapping[str, Array]
) -> tuple[Behavior, UnityPolicy, int | None, bool, float | None]:
    """Run a behavior's model beside its network, on what was recorded where that fits."""
    fits = _fit(recorded, behavior)
    seen = recorded if fits else _made_up(behavior)
    rows, difference = _compare(unity_model(policy, behavior), policy, behavior, seen)
    if difference is not None and difference > TOLERANCE:
        raise ExportError(
            "{path}: the exported model's actions for '{base_name}' are up to {difference:g} away from the "
            "checkpoint's; expected {tolerance:g} at most. Nothing was written. Please report this with the run "
            "folder.",
            path=path,
            base_name=behavior.base_name,
            difference=difference,
            tolerance=TOLERANCE,
        )
    return behavior, policy, rows, fits, difference


def _compare(
    model: Any, policy: UnityPolicy, behavior: Behavior, seen: Mapping[str, Array]
) -> tuple[int | None, float | None]:
    """Run model and checkpoint side by side, everything allowed and with drawn masks."""
    rows = len(next(iter(seen.values())))
    try:
        free = check_unity_model(model, policy, behavior, seen)
    except MissingExtraError:
        return None, None
    masked = check_unity_model(model, policy, behavior, seen, _masks(behavior, rows))
    return rows, max(free, masked)


def _masks(behavior: Behavior, rows: int) -> Array | None:
    """Draw what is allowed, bool (R, sum of branches): at least one choice of every branch."""
    rng = np.random.default_rng(0)
    parts = []
    for size in behavior.actions.branches:
        part = rng.random((rows, size)) < 0.5
        part[np.arange(rows), rng.integers(0, size, rows)] = True
        parts.append(part)
    return np.concatenate(parts, axis=1) if parts else None


def _fit(rows: Mapping[str, Array], behavior: Behavior) -> bool:
    """Tell whether these are observations of the behavior."""
    return all(
        sensor.name in rows and rows[sensor.name].shape[1:] == sensor.shape and len(rows[sensor.name]) > 0
        for sensor in behavior.sensors
    )


def _made_up(behavior: Behavior) -> dict[str, Array]:
    rng = np.random.default_rng(0)
    return {
        sensor.name: rng.integers(0, 256, (MADE_UP_ROWS, *sensor.shape)).astype(np.uint8)
        if sensor.compressed
        else rng.random((MADE_UP_ROWS, *sensor.shape), np.float32)
        for sensor in behavior.sensors
    }
