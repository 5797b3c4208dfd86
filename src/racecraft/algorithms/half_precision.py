"""Multiply in bfloat16 while the weights stay float32. Begin with `Bfloat16Copy`.

Autocast turns every weight into bfloat16 and every gradient back in new memory at each step; the AWS networks have 5.8
million weights in one layer. A copy of half the precision keeps its numbers in one place, and explores in bfloat16,
too.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from typing import Any

import torch
from torch import nn

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.networks import ActorCritic, Image, Vector


def processor_precision(precision: str) -> str:
    """Return the precision that a setting stands for on this machine.

    `auto` is bfloat16 where the processor multiplies it by itself (elsewhere it is slower than float32), and float32
    where torch is too old to say.
    """
    if precision != "auto":
        return precision
    capabilities_of: Callable[[], Mapping[str, Any]] = getattr(torch.cpu, "get_capabilities", dict)
    result = capabilities_of()
    return "bfloat16" if result.get("avx512_bf16") or result.get("amx_bf16") else "float32"


class Bfloat16Copy:
    """A network whose bodies are bfloat16 copies of another's; the heads are the other's own, in float32.

    Args:
        network: The float32 network that is optimised, saved and shipped.
    """

    def __init__(self, network: ActorCritic) -> None:
        self.network = _with_half_encoders(network)
        """Acts, values and learns; what its bodies learn lands in the float32 network by `hand_over`."""
        pairs = enumerate(zip(network.parameters(), self.network.parameters(), strict=True))
        self._pairs = [(index, whole, half) for index, (whole, half) in pairs if half is not whole]

    def hand_over(self) -> None:
        """Give the float32 network the gradients that the twin has found."""
        for _, whole, half in self._pairs:
            if half.grad is None:
                whole.grad = None
            elif whole.grad is None:
                whole.grad = half.grad.float()
            else:
                whole.grad.copy_(half.grad)

    @torch.no_grad()
    def refresh(self) -> None:
        """Take over the float32 weights, rounded; due whenever they have changed."""
        for _, whole, half in self._pairs:
            half.copy_(whole)

    def step(self, optimiser: Adam, part: Collection[int] | None = None) -> None:
        """Step the float32 weights by what the twin has found, and take them over: each in one pass over memory.

        The same as `hand_over`, a step and `refresh`, which millions of weights would pass through four times. With
        `part` only the weights at those places among all are stepped.
        """
        if any(whole.device.type != "cpu" for _, whole, _ in self._pairs):
            self.hand_over()
            optimiser.step()
            self.refresh()
            return
        for index, whole, half in self._pairs:
            if part is not None and index not in part:
                continue
            whole.grad = None  # or it would be stepped by that as well
            if half.grad is not None:
                optimiser.step_by_half(index, half)
        optimiser.step(part)


def _with_half_encoders(network: ActorCritic) -> ActorCritic:
    twin = copy.deepcopy(network)
    twin.policy_head, twin.value_head, twin.log_std = network.policy_head, network.value_head, network.log_std
    for whole, half in ((network.policy_body, twin.policy_body), (network.critic_body, twin.critic_body)):
        if whole is not None and half is not None:
            _halve(half)
            _share_statistics(whole, half)
    return twin


def _halve(body: nn.Module) -> None:
    body.to(torch.bfloat16)
    for part in body.modules():
        if isinstance(part, Image | Vector):
            part.dtype = torch.bfloat16


def _share_statistics(whole: nn.Module, half: nn.Module) -> None:
    """Let the twin read the running statistics of the other: they are no weights, and stay float64."""
    for one, other in zip(list(whole.modules()), list(half.modules()), strict=True):
        if isinstance(one, Vector) and isinstance(other, Vector):
            other.statistics = one.statistics
