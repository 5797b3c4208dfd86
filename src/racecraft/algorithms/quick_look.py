"""A few rows through a small dense network, in NumPy. Begin with `quick_look`.

Twenty rows through 64 x 64 units are 9 us of NumPy and 37 of PyTorch's modules (one core of an EPYC), which are made
for larger work; a tick of a small world costs little more. The numbers are the same to some digits of float32.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.dense_layers import dense_layers
from racecraft.algorithms.networks import ActorCritic
from racecraft.algorithms.recurrent_network import RecurrentActorCritic
from racecraft.contract.world import Array

MOST_PRODUCTS = 1 << 18
"""Rows times weights of a layer up to which it is asked; OpenBLAS keeps to one thread there (its `interface/gemm.c`:
SMP_THRESHOLD_MIN times GEMM_MULTITHREAD_THRESHOLD), and beyond PyTorch's wrappers weigh little."""


def quick_look(network: ActorCritic) -> QuickLook | None:
    """Return the quick way from what is seen to the policy's parameters; None: there is none through this network.

    There is one through dense layers over one vector that is read as it is.
    """
    layers = dense_layers(network.policy_body)
    if layers is None or layers.vector.statistics is not None or isinstance(network, RecurrentActorCritic):
        return None
    return QuickLook(layers.name, [*layers.linear, network.policy_head], layers.is_tanh)


class QuickLook:
    """The layers of a policy as arrays that share their memory, so that they follow while it learns.

    Args:
        name: Of the observation that it sees.
        layers: One after the other; behind each but the last is a non-linearity.
        is_tanh: Whether that is tanh; else it is ReLU.
    """

    def __init__(self, name: str, layers: list[nn.Linear], is_tanh: bool) -> None:
        self.name, self._layers, self._is_tanh = name, layers, is_tanh
        self._widest = max(one.weight.numel() for one in layers)
        self._places: list[int] = []
        self._arrays: list[tuple[Array, Array]] = []

    def params(self, seen: Tensor) -> Tensor | None:
        """Return the policy's parameters (R, P) of R rows; None where PyTorch is to be asked."""
        if len(seen) * self._widest > MOST_PRODUCTS or not seen.is_cpu or not self._find():
            return None
        passed = seen.numpy().reshape(len(seen), -1).astype(np.float32, copy=False)
        last = len(self._arrays) - 1
        for place, (weight, bias) in enumerate(self._arrays):
            passed = passed @ weight
            passed += bias
            if place < last:
                passed = np.tanh(passed, out=passed) if self._is_tanh else np.maximum(passed, 0.0, out=passed)
        return torch.from_numpy(passed)

    def _find(self) -> bool:
        """Look where the weights lie, and tell whether they can be read here: a network may be moved or copied."""
        places = [part.data_ptr() for one in self._layers for part in (one.weight, one.bias)]
        if places != self._places:
            parts = [(one.weight.detach(), one.bias.detach()) for one in self._layers]
            plain = all(part.is_cpu and part.dtype == torch.float32 for pair in parts for part in pair)
            self._arrays = [(weight.numpy().T, bias.numpy()) for weight, bias in parts] if plain else []
            self._places = places
        return bool(self._arrays)
