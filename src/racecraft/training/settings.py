"""Settings of every training, whatever its world: how it is judged and where the work is done."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from racecraft.algorithms.building import signal_groups
from racecraft.algorithms.registry import Algorithm
from racecraft.contract.errors import SettingError
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.settings.composition import Settings
from racecraft.settings.table import check_group, setting

JUDGING_SHARE = 0.25
"""Steps of evaluations for each step of training: a fifth of all."""


@dataclass(frozen=True)
class EvaluationConfig:
    """How progress is judged while training."""

    every: int = setting(1, "Evaluate after every so many iterations.", unit="iterations", low=1)
    share: float | None = setting(
        None,
        "Steps that evaluations may take for each step of training: after a longer one, iterations pass unjudged until "
        "it is made up for. none: no limit.",
        low=0.01,
        high=1000.0,
    )
    episodes: int = setting(5, "Greedy episodes of one evaluation, starts spread round the track.", low=1, high=1000)
    best_by: str = setting(
        "progress",
        "What makes a checkpoint of a car the best: mean progress, mean reward (the reward function is asked then), "
        "mean lap time (an unfinished lap counts 999.999 s), or the pace of the latest five evaluations together (an "
        "unfinished lap counts as two). Of equals the newer; of paces within 5 %, too.",
        choices=("progress", "reward", "laptime", "pace"),
    )
    averaged: float = setting(
        0.0,
        "The policy that is judged and kept has the mean of the latest weights, over this share of the updates so far; "
        "learning goes on from the latest. 0: the latest weights themselves.",
        low=0.0,
        high=1.0,
    )
    stable_after: int = setting(2, "Evaluations in a row, all laps complete, that count as stable.", low=1)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class RuntimeConfig:
    """Where the work is done."""

    threads: int | None = setting(None, "CPU threads for worlds and learner; none takes every core.", low=1)
    device: str = setting("cpu", "Device of the learner.", choices=("cpu", "cuda"))
    keep_every: int = setting(
        1,
        "Weights of every so many iterations stay on the disk, beside the untrained, the best and the last two.",
        unit="iterations",
        low=1,
    )
    keep_count: int | None = setting(
        200,
        "Besides the untrained, the best and the last two, weights of at most so many iterations stay, evaluated ones "
        "first, spread over the training (--keep best,last,N); none: all (--keep all).",
        low=0,
    )
    keep_mib: int = setting(
        3814, "Weights of one run take at most so much of the disk; the oldest go first.", unit="MiB", low=1
    )
    tensorboard: bool = setting(
        False, "Whether curves are also written for TensorBoard, into the run folder's `tensorboard`."
    )
    mlflow: str | None = setting(
        None,
        "Address of an MLflow that is told of the training, too (http://HOST:PORT, sqlite:///FILE). true: "
        "MLFLOW_TRACKING_URI, else `mlflow.db` beside the run folder. none: nobody.",
    )

    def __post_init__(self) -> None:
        check_group(self)


def keep_override(text: str) -> str:
    """Return `--keep best,last,N` as the setting it stands for.

    >>> keep_override("best,last,10"), keep_override("all")
    ('runtime.keep_count=10', 'runtime.keep_count=none')

    Raises:
        SettingError: As `kept_count`.
    """
    count = kept_count(text)
    return f"runtime.keep_count={'none' if count is None else count}"


def kept_count(text: str) -> int | None:
    """Return how many checkpoints stay besides the best and the last two of `best,last,N`; None for `all`.

    Raises:
        SettingError: It is neither `all` nor best,last with a number.
    """
    if text.strip() == "all":
        return None
    *names, count = [part.strip() for part in f"{text},0".split(",")[:3]]
    if names != ["best", "last"] or not count.isdecimal() or text.count(",") > 2:
        raise SettingError(
            "--keep is {text!r}; expected all, best,last, or best,last,N: the best, the last two and N more.", text=text
        )
    return int(count)


def composed(world: Settings, algorithm: Algorithm, tuned: Any = None) -> Settings:
    """Return a world's settings with the group of an algorithm in them, behind the network's, and what it remembers.

    Args:
        world: The groups of the world and of the loop, that of the algorithm left out.
        algorithm: What learns.
        tuned: The algorithm's group as it serves this world; None: its own defaults.

    An algorithm that learns from whole episodes is given one of every world, where nothing else is set.

    >>> from racecraft.algorithms.registry import find_algorithm
    >>> list(composed(Settings(network=1, runtime=2), find_algorithm("ppo")))
    ['network', 'ppo', 'curiosity', 'rnd', 'gail', 'imitation', 'runtime']
    """
    if algorithm.replay and "replay" not in world:
        world = world.with_group("replay", ReplayConfig(**algorithm.replay_values))
    if algorithm.whole_episodes and world.rollout.episodes_per_iteration is None:
        quota = world.rollout.num_worlds  # one episode of every world
        world = world.with_group("rollout", replace(world.rollout, episodes_per_iteration=quota))
    own: dict[str, Any] = {}
    if algorithm.group:
        own[algorithm.group] = tuned if tuned is not None else algorithm.config_class()()
    if algorithm.reward_signals:
        own |= signal_groups()
    groups: dict[str, Any] = {}
    for name in world:
        groups[name] = getattr(world, name)
        if name == "network":
            groups |= own
    return Settings(**{**groups, **own})
