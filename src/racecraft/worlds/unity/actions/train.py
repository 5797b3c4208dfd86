"""Train in a Unity scene, or let a policy play there: options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import Planned, TrainedRun, train_run
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option

if TYPE_CHECKING:
    from racecraft.worlds.unity.training.plan import UnityRequest

ENV_ARGS = "--env-args"


@dataclass(frozen=True, kw_only=True)
class SceneOptions(Request):
    """What of a scene learns, and how its player runs."""

    PANEL: ClassVar[str] = "The scene"
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

    kind: ClassVar[str] = "unity"
    example: ClassVar[str] = "runs/Basic-1"

    build: str | None = argument(
        "A build's file, folder or zip, registry:NAME, editor, or builtin:Basic; by default the configuration's "
        "env_path.",
        None,
        metavar="BUILD",
    )
    stop: tuple[str, ...] = option((), "score=0.92, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/BEHAVIOR-N.")
    seed: int | None = option(None, "Of the learner and the player; by default the configuration's, or 1.", low=0)
    inference: bool = option(False, "Learn nothing; let what --from (or --run --resume) names play.")
    scene: SceneOptions = group(SceneOptions)

    @property
    def model(self) -> str | None:
        """The behavior that is named."""
        return self.scene.behavior

    def request(self, progress: Callable[[str], None]) -> UnityRequest:
        """Return the request of a new run."""
        return self.request_from(self.source(progress))

    def request_from(self, source: str | None) -> UnityRequest:
        """Return the request of a run that begins with the weights of another, or fresh ones."""
        from racecraft.worlds.unity.training.plan import UnityRequest

        return UnityRequest(self.build, **self.scene.values(), **self.for_request(source))


@action
def train(
    request: UnityTraining, progress: Progress = quiet
) -> TrainedRun | TrainedSeeds | Submitted | Planned | Figures:
    """Train the agents of a Unity scene.

    Examples:

        racecraft unity train builtin:Basic

        racecraft unity train builds/Game.x86_64 --config Game.yaml --stop minutes=60

        racecraft unity train builds/Game --num-envs 4 --base-port 5005 --env-args --level 2

        racecraft unity train --run runs/Basic-1 --resume --stop minutes=10

        racecraft unity train --from runs/Basic-1 --inference
    """
    return _play(request, progress) if request.inference else train_run(request, progress)


def _play(request: UnityTraining, progress: Progress) -> Figures:
    """Let a policy play, which learns nothing.

    Raises:
        SettingError: What plays is to be a job, or to be mirrored.
    """
    from racecraft.worlds.unity.training.inference import play_scene

    if request.detach:
        raise SettingError("--inference and --detach were given; expected one of them: what plays, is played here.")
    if request.mirror is not None:
        raise SettingError("--inference and --mirror were given; expected one of them: what plays leaves no run.")
    resumes = request.resume and request.run is not None
    source = f"{request.run}:last" if resumes else request.source(progress)
    return Figures(play_scene(request.request_from(source), progress))
