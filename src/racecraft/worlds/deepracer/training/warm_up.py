"""What the first training in a process waits for, done before: code compiled, kernels of torch planned."""

from __future__ import annotations

import tempfile
from pathlib import Path

from racecraft.training import worlds
from racecraft.training.callbacks import NullCallback
from racecraft.worlds.deepracer.training.plan import RaceRequest

SHORT = ("rollout.horizon=16", "ppo.epochs=1", "evaluation.episodes=1", "evaluation.every=1")
"""All that a training does, and as little of it as may be."""


def warm_up() -> None:
    """Train a car for one iteration in a folder that is thrown away.

    Later trainings in this process learn the same to the bit: every generator of theirs is seeded by their own seed.
    """
    with tempfile.TemporaryDirectory() as folder:
        request = RaceRequest(stops=("iterations=1",), run=Path(folder) / "run", overrides=SHORT)
        worlds.train(request, NullCallback(), on_message=lambda line: None)
