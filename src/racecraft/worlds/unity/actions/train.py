"""Train in a Unity scene, or let a policy play there: options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.training_options import TrainingOptions
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.worlds.unity.training.plan import UnityRequest

ENV_ARGS = "--env-args"


@dataclass(frozen=True, kw_only=True)
class SceneOptions(Request):
    """What of a scene learns, and how its player runs."""

    config: Path | None = option(None, "ML-Agents' trainer configuration, the YAML file.")
    behavior: str | None = option(
        None, "Which behavior learns; by default those of the configuration, or all of the scene."
    )
    max_agents: int | None = option(
        None, "Agents of a behavior that live at once; by default those that ask first.", low=1
    )
    graphics: bool | None = option(None, "Let the player open a window.")
    num_envs: int | None = option(None, "Players that teach side by side; by default the configuration's, or 1.", low=1)
    time_scale: float | None = option(None, "Simulated seconds a second; by default the configuration's, or 20.")
    base_port: int | None = option(
        None, "The first player's port, the others' follow; by default whichever are free.", low=1, high=65535
    )
    nearest: bool = option(False, "Let PPO learn where the configuration asks for POCA, self-play or SAC of choices.")
    env_args: tuple[str, ...] = option((), "Arguments for the player: all words that follow.", metavar="WORDS …")


@dataclass(frozen=True, kw_only=True)
class UnityTraining(TrainingOptions):
    """What a training in a scene is asked."""

    stop: tuple[str, ...] = option((), "score=0.92, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/BEHAVIOR-N.")
    seed: int | None = option(None, "Of the learner and the player; by default the configuration's, or 1.", low=0)


def unity_request(build: str | None, scene: SceneOptions, options: UnityTraining, source: str | None) -> UnityRequest:
    """Return the request of a new run."""
    from racecraft.worlds.unity.training.plan import UnityRequest

    return UnityRequest(
        build,
        scene.config,
        scene.behavior,
        scene.graphics,
        scene.max_agents,
        scene.env_args,
        scene.num_envs,
        scene.time_scale,
        scene.nearest,
        scene.base_port,
        **options.for_request(source),
    )


def play(
    build: str | None, scene: SceneOptions, options: UnityTraining, progress: Callable[[str], None]
) -> dict[str, Any]:
    """Let a policy play, which learns nothing.

    Raises:
        SettingError: What plays is to be a job, or to be mirrored.
    """
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.unity.training.inference import play_scene

    if options.detach:
        raise SettingError("--inference and --detach were given; expected one of them: what plays, is played here.")
    if options.mirror is not None:
        raise SettingError("--inference and --mirror were given; expected one of them: what plays leaves no run.")
    source = f"{options.run}:last" if options.resume and options.run is not None else options.source(progress)
    return play_scene(unity_request(build, scene, options, source), progress)
