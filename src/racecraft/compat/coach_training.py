"""Train what a preset of Coach's describes. Begin with `train_preset`; `coach_config.py` translates."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

from racecraft.compat.coach_config import Part, Translation, translated
from racecraft.compat.rllib_training import register_env, registered
from racecraft.compat.stored_environments import exit_if_restarted, script_code
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import add_cwd_to_path
from racecraft.formats.run_folder import JOB, STOP
from racecraft.training import worlds
from racecraft.training.callbacks import IterationReport, NullCallback
from racecraft.training.trained import Trained
from racecraft.worlds.gymnasium.training.trainer import GymRequest

LONGEST_EPISODE = 10_000
"""Steps after which an episode of the script's own environment is cut; Coach cuts none."""


class CoachLines(NullCallback):
    """Says after each iteration what Coach said after an episode, so that metric definitions go on finding it.

    An iteration has many episodes: the reward is their mean, and `Episode` counts them.

    Args:
        most_episodes: After so many the training is asked to stop; None: never.
    """

    def __init__(self, most_episodes: int | None = None) -> None:
        self._told = self._episodes = 0
        self._most, self._run = most_episodes, Path()

    def run_made(self, path: Path) -> None:
        """Know where a stop is asked for."""
        self._run = path

    def iteration(self, report: IterationReport) -> None:
        """Print an iteration, and its evaluation where there was one; one that is judged afterwards is told once."""
        if report.iteration != self._told:
            self._told, self._episodes = report.iteration, self._episodes + report.episodes
            if report.mean_reward is not None:
                self._print("Training", report, report.mean_reward)
            if self._most is not None and self._episodes >= self._most:
                (self._run / STOP).touch()
        if report.result is not None:
            self._print("Testing", report, report.result.score)

    def _print(self, phase: str, report: IterationReport, reward: float) -> None:
        print(
            f"{phase}> Name=main_level/agent, Worker=0, Episode={self._episodes}, Total reward={reward:.6g}, "
            f"Steps={report.steps}, Training iteration={report.iteration}", flush=True,
        )  # fmt: skip


def train_preset(graph: Part) -> Trained:
    """Train; inside a job the run folder stands in its model, and a job that was interrupted goes on there.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    translation = translated(graph)
    for sentence in translation.notes:
        print(f"- {sentence}")
    environment = _environment(translation)
    exit_if_restarted()
    model = os.environ.get("SM_MODEL_DIR")
    run = Path(model, "run") if model else None
    if run is not None and (run / JOB).exists():
        return worlds.resume(run, (translation.stop,), CoachLines(translation.episodes), print, "gymnasium")
    request = GymRequest(
        environment, algorithm=translation.algorithm, stops=(translation.stop,), run=run,
        overrides=tuple(translation.settings),
        environment_code=script_code(environment, by_name=True) if ":" in translation.environment else None,
    )  # fmt: skip
    return worlds.train(request, CoachLines(translation.episodes), print)


def _environment(translation: Translation) -> str:
    """Return the id of a level: Gymnasium's own, or a class beside the script."""
    module, colon, name = translation.environment.partition(":")
    if not colon:
        return translation.environment
    add_cwd_to_path()
    try:
        made: Any = getattr(importlib.import_module(module.removesuffix(".py")), name)
    except (ImportError, AttributeError) as error:
        raise SettingError(
            "level {environment}: {error}; expected a class of that name in a module beside the script.",
            environment=translation.environment,
            error=error,
        ) from error
    register_env(name, lambda context: made(**context))
    return registered(name, translation.env_words, LONGEST_EPISODE)
