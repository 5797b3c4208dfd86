"""From a preset, a racer's JSON files and overrides to the settings of one training.

The order is: the preset, then what `hyperparameters.json` gives, then each `--set`. Whatever is not used is said.
"""

from __future__ import annotations

from collections.abc import Iterable

from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.hyperparameters import Hyperparameters
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import apply_overrides, with_values

PRESETS = {"fast": "the learner and network that lap soonest on two cores"}
"""Every preset, with what it seeks."""

FROM_JSON = {
    "lr": ("ppo", "learning_rate"),
    "discount_factor": ("ppo", "discount"),
    "num_epochs": ("ppo", "epochs"),
    "batch_size": ("ppo", "batch_size"),
    "beta_entropy": ("ppo", "entropy_weight"),
    "loss_type": ("ppo", "value_loss"),
    "num_episodes_between_training": ("rollout", "episodes_per_iteration"),
}
"""Which setting each hyperparameter becomes."""

LOSSES = {"huber": "huber", "mean squared error": "mse"}

UNUSED = {
    "e_greedy_value": "exploration is categorical",
    "epsilon_steps": "exploration is categorical",
    "stack_size": "one frame is seen at a time, as at AWS",
    "sac_alpha": "it belongs to SAC",
    "term_cond_avg_score": "AWS ignored it too; say `--stop`",
    "term_cond_max_episodes": "say `--stop iterations=…`",
}
"""Hyperparameters that change nothing here, and why."""


def settings_for(
    preset: str, hyperparameters: Hyperparameters, overrides: Iterable[str]
) -> tuple[TrainSettings, list[str]]:
    """Return the settings of a training and what is worth saying about them, a clause each.

    Raises:
        SettingError: An unknown preset, or an override that is not legal.
    """
    if preset not in PRESETS:
        raise SettingError(f"There is no preset '{preset}'. {nearest(preset, PRESETS)}")
    settings, notes = _with_json(TrainSettings(), hyperparameters)
    settings = apply_overrides(settings, overrides)
    settings = fit_worlds_to_episodes(settings, notes)
    return settings, notes


def _with_json(settings: TrainSettings, given: Hyperparameters) -> tuple[TrainSettings, list[str]]:
    notes = []
    for name in given.given:
        value = getattr(given, name)
        if name in FROM_JSON:
            group, setting = FROM_JSON[name]
            settings = with_values(settings, group, {setting: LOSSES[value] if name == "loss_type" else value})
        elif name == "exploration_type":
            if value != "categorical":
                notes.append(f"exploration_type '{value}' is valid and not built yet; exploration is categorical")
        else:
            notes.append(f"{name} changes nothing: {UNUSED[name]}")
    return settings, notes


def fit_worlds_to_episodes(settings: TrainSettings, notes: list[str]) -> TrainSettings:
    """Give every world the same quota of whole episodes: their number must divide the episodes of an iteration.

    A change is added to `notes`.
    """
    episodes, worlds = settings.rollout.episodes_per_iteration, settings.rollout.num_worlds
    if episodes is None or episodes % worlds == 0:
        return settings
    fitting = max(count for count in range(1, min(episodes, worlds) + 1) if episodes % count == 0)
    notes.append(f"{fitting} worlds, not {worlds}, so that each plays {episodes // fitting} of {episodes} episodes")
    return with_values(settings, "rollout", {"num_worlds": fitting})
