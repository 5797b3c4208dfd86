"""`ray`, as launcher scripts of SageMaker RL import it: what they ask for, `sagemaker_rl` does."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.ray import tune


def init(*args: Any, **words: Any) -> None:
    """Nothing is to be begun on one machine."""


def shutdown() -> None:
    """Nothing is to be ended."""


__all__ = ["init", "shutdown", "tune"]
