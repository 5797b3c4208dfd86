"""Stable-Baselines' words for PPO1, as SageMaker's launcher takes them, in ours. Begin with `WORDS`, the one table.

What PPO1 and its `MlpPolicy` do without being asked stands in `DEFAULTS`. A word that stands nowhere is refused by
Python itself: the launcher names its arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import SettingError, nearest

WORLDS = 8
"""Copies of the environment side by side; PPO1 has one a process."""
JUDGED_EPISODES = 4
"""Episodes of one evaluation."""
LINEAR, CONSTANT = "linear", "constant"
WORDS: Mapping[str, tuple[str, str]] = {
    "timesteps_per_actorbatch": ("", f"rollout.horizon = timesteps_per_actorbatch / {WORLDS} worlds"),
    "clip_param": ("ppo.clip", ""),
    "entcoeff": ("ppo.entropy_weight", ""),
    "optim_epochs": ("ppo.epochs", ""),
    "optim_stepsize": ("ppo.learning_rate", ""),
    "optim_batchsize": ("ppo.batch_size", ""),
    "gamma": ("ppo.discount", ""),
    "lam": ("ppo.gae_lambda", ""),
    "schedule": ("", f"{LINEAR}: ppo.learning_rate_schedule and ppo.clip_schedule (which ends at 0.1); {CONSTANT}; "
                     "others are refused"),
    "num_timesteps": ("", "--stop steps=…"),
    "verbose": ("", "nothing: every iteration is told in PPO1's table"),
    "env": ("", "what create_env made is made again for every world; another environment is copied"),
    "output_path": ("", "where 0.monitor.csv and rl_out.mp4 go; in a job /opt/ml/… is the job's own"),
}  # fmt: skip
"""Arguments of `SagemakerStableBaselinesPPO1Launcher`: (setting of ours or "", how it is taken otherwise)."""
DEFAULTS = (
    "network.hidden_units=64,64", "network.activation=tanh", "network.separate_networks=true",
    "ppo.standardise=rollout", "ppo.drop_remainder=true", "ppo.max_grad_norm=none", "ppo.value_weight=1",
    "ppo.adam_epsilon=0.00001",
)  # fmt: skip
"""What PPO1 and its MlpPolicy do by themselves (Stable-Baselines 2)."""


@dataclass(frozen=True)
class Translation:
    """What a launcher was given, in our words."""

    settings: tuple[str, ...]
    stop: str


def translated(words: Mapping[str, Any]) -> Translation:
    """Return PPO1's arguments in our words.

    Raises:
        SettingError: A schedule that has no counterpart, or a value that is no number.

    >>> told = translated({"gamma": 0.9, "timesteps_per_actorbatch": 2048, "schedule": "linear", "num_timesteps": 1e4})
    >>> told.stop, told.settings[:4]
    ('steps=10000', ('rollout.num_worlds=8', 'rollout.horizon=256', 'evaluation.episodes=4', 'ppo.discount=0.9'))
    """
    horizon = max(1, round(_number(words, "timesteps_per_actorbatch", 256) / WORLDS))
    settings = [f"rollout.num_worlds={WORLDS}", f"rollout.horizon={horizon}", f"evaluation.episodes={JUDGED_EPISODES}"]
    settings += [f"{WORDS[name][0]}={value}" for name, value in words.items() if WORDS[name][0]]
    schedule = words.get("schedule", LINEAR)
    if schedule not in (LINEAR, CONSTANT):
        raise SettingError(
            "schedule is {schedule!r}; expected {linear} or {constant}: others of PPO1's have no counterpart here. "
            "{hint}",
            schedule=schedule,
            linear=LINEAR,
            constant=CONSTANT,
            hint=nearest(str(schedule), (LINEAR, CONSTANT)),
        )
    settings += [f"ppo.learning_rate_schedule={schedule}", f"ppo.clip_schedule={schedule}"]
    return Translation((*settings, *DEFAULTS), f"steps={_number(words, 'num_timesteps', 1e4):.12g}")


def _number(words: Mapping[str, Any], name: str, default: float) -> float:
    try:
        return float(words.get(name, default))
    except (TypeError, ValueError):
        raise SettingError("{name} is {words!r}; expected a number.", name=name, words=words[name]) from None
