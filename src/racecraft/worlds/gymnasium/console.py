"""Gymnasium's environments in the console: the form in which a training is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.algorithms.registry import choices
from racecraft.console.form import Field, Step, common_fields, common_words
from racecraft.console.parts import WorldParts
from racecraft.contract.errors import SettingError


class GymnasiumParts(WorldParts):
    """Gymnasium's environments in the console."""

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the one step in which a training is made."""
        environment = Field(
            name="environment", label="Environment", default="CartPole-v1", kind="line", matters=True,
            sentence="A registered id, such as CartPole-v1.", names=(("argument", "ID"),),
        )  # fmt: skip
        score = Field(
            name="score", label="End at a mean score of", default="", kind="line",
            sentence="Empty: only the time ends it.", names=(("--stop", "score=475"),),
        )  # fmt: skip
        return [Step(key="training", title="Training", fields=(environment, score, *common_fields(choices())))]

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return `gym train` and its options.

        Raises:
            SettingError: No environment is named, or one of a module of its own.
        """
        full = self.defaults() | dict(values)
        environment, score = str(full["environment"]).strip(), str(full["score"]).strip()
        if not environment or environment.startswith("-") or ":" in environment:  # "module:ID" would import a module
            raise SettingError(
                "Environment: found {found!r}; expected a registered id, such as CartPole-v1.", found=environment
            )
        stop = [f"--stop=score={score}"] if score else []
        return ["gym", "train", environment, *stop, *common_words(full)]

    def values_of(self, run: Any) -> dict[str, Any]:
        """Return the environment and algorithm of a run."""
        job = run.read_job()
        request = job.get("asked") or {}
        found = {"environment": request.get("id") or request.get("environment"), "algorithm": job.get("algorithm")}
        return self.defaults() | {name: value for name, value in found.items() if value}
