"""Train in an environment: its options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.settings.request import option

if TYPE_CHECKING:
    from racecraft.worlds.gymnasium.training.trainer import GymRequest


@dataclass(frozen=True, kw_only=True)
class GymTraining(TrainingOptions):
    """What a training of an environment is asked."""

    stop: tuple[str, ...] = option((), "score=475, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/ID-N.")
    env_args: tuple[str, ...] = option(
        (), "NAME=VALUE, an argument with which the environment is made; a value is JSON or text; may be repeated."
    )
    wrapper: tuple[str, ...] = option(
        (),
        "Wrapper around the environment, of gymnasium.wrappers or MODULE:CLASS; may be repeated, the innermost first.",
    )


def gym_request(environment: str | None, options: GymTraining, progress: Callable[[str], None]) -> GymRequest:
    """Return the request of a new run.

    Raises:
        SettingError: No environment is named.
    """
    from racecraft.worlds.gymnasium.env.recipe import Recipe
    from racecraft.worlds.gymnasium.training.trainer import GymRequest

    if environment is None:
        raise SettingError("no environment is named; expected ID, such as: racecraft gym train CartPole-v1")
    recipe = Recipe.of_options(options.env_args, options.wrapper)
    return GymRequest(environment, recipe=recipe, **options.for_request(options.source(progress)))
