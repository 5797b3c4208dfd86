"""Begin a training with a clone of recorded episodes: `--from laps.safetensors`. Begin with `clone_recording`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

from racecraft.algorithms.behaviour_cloning import BcConfig, BcLearner
from racecraft.algorithms.building import EVALUATION, IMITATION, SIGNALS, build_learner
from racecraft.algorithms.learner import Learner
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.contract.errors import SettingError
from racecraft.contract.world import WorldSpec
from racecraft.settings.composition import Settings

SUFFIX = ".safetensors"
MINIBATCHES = 400
"""Gradient steps of the clone, rounded up to whole passes over the recording."""


def is_recording(source: str) -> bool:
    """Tell whether what a training begins with is a file of recorded episodes."""
    return source.endswith(SUFFIX) and Path(source).is_file()


def clone_recording(learner: Learner, path: Path, spec: WorldSpec, settings: Settings, seed: int) -> tuple[str, ...]:
    """Let a learner begin with the weights of a clone of recorded episodes.

    Args:
        learner: With a policy network as `--algorithm bc` learns one.
        path: The recording.
        spec: The world's promise.
        settings: The training's; the clone has the same network.
        seed: Of the clone's first weights and the order of minibatches.

    Returns:
        What is worth saying, a clause.

    Raises:
        CheckpointError: The file holds no recorded episodes.
        SettingError: It was recorded in another world, or the learner has another kind of network.
    """
    group = BcConfig(demonstrations=str(path))
    for beside in (*SIGNALS, IMITATION, EVALUATION):
        settings = settings.without(beside)
    built = build_learner(find_algorithm("bc"), spec, settings.with_group("bc", group), seed)
    clone = cast(BcLearner, getattr(built, "inner", built))
    mine = to_arrays(learner.state_dict())["network"]
    weights = to_arrays(clone.state_dict())["network"]
    if {name: part.shape for name, part in mine.items()} != {name: part.shape for name, part in weights.items()}:
        raise SettingError(
            "--from {path}: this algorithm's network is not one that a clone can have; expected that of ppo. "
            "Use imitation.demonstrations to learn beside it.",
            path=path,
        )
    passes = math.ceil(MINIBATCHES * group.batch_size / max(len(clone.taught), 1))
    figures = [clone.update(None) for _ in range(passes)][-1]
    learner.load_state_dict({"network": to_tensors(to_arrays(clone.state_dict())["network"])})
    share = 100.0 * figures["agreement"]
    return (f"begins with a clone of {path.name}, which chooses as recorded in {share:.0f} % of its ticks",)
