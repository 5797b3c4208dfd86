"""From `mlagents-learn`'s configuration to the words of `UnityWorld`. Begin at `words_of`."""

from __future__ import annotations

from typing import Any

from racecraft.worlds.unity.env.side_channels import Gaussian, MultiRange, Uniform
from racecraft.worlds.unity.env.world import ENGINE_FOR_INFERENCE, ENGINE_FOR_TRAINING
from racecraft.worlds.unity.files.trainer_yaml import Sampler, TrainerConfig


def words_of(config: TrainerConfig) -> dict[str, Any]:
    """Return what the file says of players, as arguments of `UnityWorld`; the build itself is `config.env_path`.

    Left to the caller: `config.base_port`, because worlds that live side by side cannot share ports.

    >>> words_of(TrainerConfig({}, num_envs=3, env_args=("--level", "2")))["num_players"]
    3
    """
    defaults = ENGINE_FOR_INFERENCE if config.inference else ENGINE_FOR_TRAINING
    words: dict[str, Any] = {"engine": {**defaults, **config.engine}}
    given = {
        "num_players": config.num_envs,
        "args": config.env_args or None,
        "num_areas": config.num_areas,
        "timeout_seconds": config.timeout_wait,
        "seed": config.seed,
        "max_lifetime_restarts": config.max_lifetime_restarts,
        "restarts_rate_limit_n": config.restarts_rate_limit_n,
        "restarts_rate_limit_period_s": config.restarts_rate_limit_period_s,
        "inference": config.inference or None,
        "graphics": None if config.no_graphics is None else not config.no_graphics,
        "parameters": {name: sampler_of(value) for name, value in config.parameters.items()} or None,
    }
    return words | {name: value for name, value in given.items() if value is not None}


def sampler_of(value: float | Sampler) -> float | Uniform | Gaussian | MultiRange:
    """Return a parameter as side channels send it.

    >>> sampler_of(Sampler("multirangeuniform", (1.0, 2.0, 5.0, 6.0)))
    MultiRange(ranges=((1.0, 2.0), (5.0, 6.0)))
    """
    if not isinstance(value, Sampler):
        return value
    numbers = value.numbers
    if value.kind == "uniform":
        return Uniform(*numbers)
    if value.kind == "gaussian":
        return Gaussian(*numbers)
    return MultiRange(tuple(zip(numbers[::2], numbers[1::2], strict=True)))
