"""Train in an environment: its options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from racecraft.actions.action import action
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import Planned, TrainedRun, train_run
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument, option

if TYPE_CHECKING:
    from racecraft.worlds.gymnasium.training.trainer import GymRequest


@dataclass(frozen=True, kw_only=True)
class GymTraining(TrainingOptions):
    """What a training of an environment is asked."""

    kind: ClassVar[str] = "gymnasium"
    example: ClassVar[str] = "runs/CartPole-v1-1"

    environment: str | None = argument(
        "A registered id, such as CartPole-v1, or MODULE:NAME of a class or function that makes an environment.",
        None,
        metavar="ID",
    )
    stop: tuple[str, ...] = option((), "score=475, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/ID-N.")
    env_args: tuple[str, ...] = option(
        (), "NAME=VALUE, an argument with which the environment is made; a value is JSON or text; may be repeated."
    )
    wrapper: tuple[str, ...] = option(
        (),
        "Wrapper around the environment, of gymnasium.wrappers or MODULE:CLASS; may be repeated, the innermost first.",
    )

    def __post_init__(self) -> None:
        """From Python the environment may be a class, a function or a ready one."""
        if self.environment is None or isinstance(self.environment, str):
            super().__post_init__()
            return
        from racecraft.worlds.gymnasium.env.recipe import named

        name, recipe = named(self.environment)
        object.__setattr__(self, "environment", name)
        super().__post_init__()
        object.__setattr__(self, "env_args", (*recipe.argument_texts(), *self.env_args))
        object.__setattr__(self, "wrapper", (*recipe.wrappers, *self.wrapper))

    @property
    def model(self) -> str | None:
        """The environment."""
        return self.environment

    def request(self, progress: Callable[[str], None]) -> GymRequest:
        """Return the request of a new run.

        Raises:
            SettingError: No environment is named.
        """
        from racecraft.worlds.gymnasium.env.recipe import Recipe
        from racecraft.worlds.gymnasium.training.trainer import GymRequest

        if self.environment is None:
            raise SettingError("no environment is named; expected ID, such as: racecraft gym train CartPole-v1")
        recipe = Recipe.of_options(self.env_args, self.wrapper)
        return GymRequest(self.environment, recipe=recipe, **self.for_request(self.source(progress)))


@action
def train(request: GymTraining, progress: Progress = quiet) -> TrainedRun | TrainedSeeds | Submitted | Planned:
    """Train until the environment is solved.

    Examples:

        racecraft gym train CartPole-v1

        racecraft gym train Pendulum-v1 --stop score=-200 --stop minutes=5

        racecraft gym train --run runs/CartPole-v1-1 --resume --stop minutes=5
    """
    return train_run(request, progress)
