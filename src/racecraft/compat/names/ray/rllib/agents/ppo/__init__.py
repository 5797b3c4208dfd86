"""`ray.rllib.agents.ppo`: imported by scripts beside a launcher; its trainer does not run here."""

from __future__ import annotations

from typing import Any

from racecraft.contract.errors import SettingError

DEFAULT_CONFIG: dict[str, Any] = {}
"""What a script lays nothing over; our own defaults hold."""


class PPOTrainer:
    """RLlib's trainer."""

    def __init__(self, *args: Any, **words: Any) -> None:
        raise SettingError(
            "PPOTrainer is RLlib's own and does not run here; expected ray.tune.run_experiments, or a script that "
            "derives from SageMakerRayLauncher."
        )


__all__ = ["DEFAULT_CONFIG", "PPOTrainer"]
