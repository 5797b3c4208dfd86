"""Which algorithm learned, by which settings, and how advice would have it learn otherwise. Begin with `Learner`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

SMALLER, MORE = 0.5, 3.0
"""What a learning rate is multiplied with to be smaller, and a weight of the entropy to ask for more of it."""
SOME_ENTROPY = 0.01
"""The weight of the entropy that is tried where there was none."""
_AWS = {"lr": "learning_rate", "beta_entropy": "entropy_weight"}
"""AWS's hyperparameters that advice speaks of, and our names of them."""


@dataclass(frozen=True)
class Learner:
    """An algorithm and what it was set to; options are "" where the settings do not tell."""

    algorithm: str = "ppo"
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """Values of settings by group, as a run's job.json tells them."""

    def smaller_steps(self) -> str:
        """Return the option that halves the learning rate.

        >>> Learner("sac", {"sac": {"learning_rate": 3e-4}}).smaller_steps()
        ' --set sac.learning_rate=0.00015'
        """
        rate = self._own("learning_rate")
        return "" if rate is None else self._option("learning_rate", SMALLER * rate)

    def more_exploration(self) -> str:
        """Return the option that weighs the entropy more; "" for algorithms that do not weigh it."""
        weight = self._own("entropy_weight")
        return "" if weight is None else self._option("entropy_weight", min(1.0, max(SOME_ENTROPY, MORE * weight)))

    def more_experience(self) -> str:
        """Return the option that has an update learn from twice as much; "" for those that learn from a replay."""
        rollout = self.settings.get("rollout", {})
        for name in ("episodes_per_iteration", "horizon"):
            if rollout.get(name):
                return f" --set rollout.{name}={2 * rollout[name]}"
        return ""

    def _own(self, name: str) -> float | None:
        value = self.settings.get(self.algorithm, {}).get(name)
        return float(value) if isinstance(value, int | float) else None

    def _option(self, name: str, value: float) -> str:
        return f" --set {self.algorithm}.{name}={value:.4g}"


def learner_of_job(job: Mapping[str, Any]) -> Learner:
    """Return what learned in a run, by its job.json."""
    return Learner(str(job.get("algorithm", "ppo")), job.get("settings", {}))


def learner_of_log(about: Mapping[str, Any]) -> Learner:
    """Return what learned in a training of AWS's, by what its files say beside the ticks (`Logs.about`)."""
    hyperparameters = about.get("hyperparameters", {})
    algorithm = "sac" if "sac_alpha" in hyperparameters else "ppo"
    return Learner(
        algorithm, {algorithm: {ours: hyperparameters[name] for name, ours in _AWS.items() if name in hyperparameters}}
    )
