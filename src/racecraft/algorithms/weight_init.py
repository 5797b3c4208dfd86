"""First weights of what a foreign model's file does not hold, such as the critic that no frozen graph has.

They are drawn as the networks of this preset begin (Glorot uniform, normalised columns for the critic's last layer,
biases 0), without torch: an import needs none of it. PPO's critic is a twin of its policy; SAC's two critics have eyes
of their own, which are twins of the actor's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from racecraft.contract.world import ActionSpec, Array, ContinuousActions

SEED = 0
POLICY_BODY, POLICY_HEAD, CRITIC_BODY, VALUE_HEAD = "policy_body", "policy_head", "critic_body", "value_head"
EYES, ACTOR, CRITIC_EYES, CRITICS = "eyes", "actor", "critic_eyes", "critics"


def init_critic(policy: Mapping[str, Array]) -> dict[str, Array]:
    """Return the critic of a PPO policy whose weights are known: its twin, with a value for a head."""
    chance = np.random.default_rng(SEED)
    head = chance.standard_normal((1, policy[f"{POLICY_HEAD}.weight"].shape[1]), np.float32)
    return {
        **_twin(policy, POLICY_BODY, CRITIC_BODY, chance),
        f"{VALUE_HEAD}.weight": head / np.linalg.norm(head, axis=1, keepdims=True),
        f"{VALUE_HEAD}.bias": np.zeros(1, np.float32),
    }


def fresh_spread(actions: ActionSpec) -> dict[str, Array]:
    """Return how widely a PPO policy over numbers explores at first: log standard deviations of 0."""
    return {"log_std": np.zeros(len(actions.low), np.float32)} if isinstance(actions, ContinuousActions) else {}


def fresh_critics(actor: Mapping[str, Array], width: int, trunk: tuple[int, ...]) -> dict[str, Array]:
    """Return SAC's two critics, one behind the other, and their eyes.

    Args:
        actor: The actor's weights, its eyes among them.
        width: Features that leave its eyes, and numbers of an action.
        trunk: Units of the dense layers.
    """
    chance = np.random.default_rng(SEED)
    weights = _twin(actor, EYES, CRITIC_EYES, chance)
    for number, (before, after) in enumerate(pairwise((width, *trunk, 1))):
        weights[f"{CRITICS}.weights.{number}"] = _glorot_uniform((2, before, after), before, after, chance)
        weights[f"{CRITICS}.biases.{number}"] = np.zeros((2, 1, after), np.float32)
    return weights


def _twin(weights: Mapping[str, Array], body: str, other: str, chance: np.random.Generator) -> dict[str, Array]:
    """Return layers of the sizes that a body's have, under another name."""
    twin: dict[str, Array] = {}
    for name, array in weights.items():
        if not name.startswith(f"{body}."):
            continue
        if array.ndim == 1:
            twin[other + name.removeprefix(body)] = np.zeros(array.shape, np.float32)
            continue
        window = math.prod(array.shape[2:])  # of a convolution; torch counts it with its channels
        into, out = array.shape[1] * window, array.shape[0] * window
        twin[other + name.removeprefix(body)] = _glorot_uniform(array.shape, into, out, chance)
    return twin


def _glorot_uniform(shape: tuple[int, ...], into: int, out: int, chance: np.random.Generator) -> Array:
    """Return Glorot's uniform numbers for a layer of so many connections into it and out of it."""
    limit = math.sqrt(6.0 / (into + out))
    array = chance.random(shape, np.float32)
    array *= 2.0 * limit
    array -= limit
    return array
