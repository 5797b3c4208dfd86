"""Unity's scenes in the console: the form in which a training is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.algorithms.registry import choices
from racecraft.console.form import Field, Step, common_fields, common_words
from racecraft.console.parts import WorldParts
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import refuses_own_code
from racecraft.formats.run_folder import RunFolder

BUILTIN = "builtin:"
"""Scenes that come along; every other one is a program of somebody's."""


class UnityParts(WorldParts):
    """Unity's scenes in the console."""

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the one step in which a training is made."""
        fields = (
            Field(
                name="build", label="Scene", default=f"{BUILTIN}Basic", kind="line", matters=True,
                sentence="A build's file, folder or zip, registry:NAME, editor, or builtin:Basic.",
                names=(("argument", "BUILD"),),
            ),
            Field(
                name="config", label="Trainer configuration", default="", kind="line",
                sentence="ML-Agents' YAML file; empty: defaults.", names=(("--config", "config.yaml"),),
            ),
            Field(
                name="behavior", label="Behavior", default="", kind="line",
                sentence="Which one learns; empty: all of the scene.", names=(("--behavior", "NAME"),),
            ),
        )  # fmt: skip
        return [Step(key="training", title="Training", fields=(*fields, *common_fields(choices())))]

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return `unity train` and its options.

        Raises:
            SettingError: No scene is named, or a program by somebody who may run none here.
        """
        full = self.defaults() | {
            name: str(values[name]).strip() for name in ("build", "config", "behavior") if name in values
        }
        build = full["build"]
        if not build or build.startswith("-"):
            raise SettingError("Scene: found {found!r}; expected a build, such as builtin:Basic.", found=build)
        if refuses_own_code.get() and not build.startswith(BUILTIN):
            raise SettingError(
                "Scene: found {found!r}, a program; expected builtin:Basic. Only this machine's owner runs programs.",
                found=build,
            )
        told = [f"--{name}={full[name]}" for name in ("config", "behavior") if full[name]]
        return ["unity", "train", build, *told, *common_words(self.defaults() | dict(values))]

    def values_of(self, run: RunFolder) -> dict[str, Any]:
        """Return the scene, behavior and algorithm of a run."""
        job = run.read_job()
        request = job.get("asked") or {}
        found = {
            "build": request.get("build"), "behavior": request.get("wish"),
            "config": request.get("config"), "algorithm": job.get("algorithm"),
        }  # fmt: skip
        return self.defaults() | {name: value for name, value in found.items() if value}
