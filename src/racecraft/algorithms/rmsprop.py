"""RMSProp as the deep Q-network was taught with: a step along the gradient over the root of its running variance.

Source: Mnih et al., "Human-level control through deep reinforcement learning", 2015, extended data table 1: the running
means of gradient and square both keep 0.95 ("gradient momentum", "squared gradient momentum"), and 0.01 is added to
the variance ("min squared gradient"), inside the root. The gradient itself is stepped along, not its mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import torch
from torch import Tensor, nn

KEPT = 0.95
"""What stays of the running means at a step."""
MIN_SQUARE = 0.01
"""Added to the variance."""


class RmsProp:
    """Steps parameters by the gradients they carry.

    Args:
        parameters: What is stepped, in place; all of them must have gradients.
        learning_rate: How long a step is.
    """

    def __init__(self, parameters: Iterable[nn.Parameter], learning_rate: float) -> None:
        self.learning_rate = learning_rate
        self._parameters = list(parameters)
        self._means = [torch.zeros_like(one.data) for one in self._parameters]
        self._squares = [torch.zeros_like(one.data) for one in self._parameters]

    @torch.no_grad()
    def step(self) -> None:
        """Take one step."""
        weights = [one.data for one in self._parameters]
        gradients = [one.grad for one in self._parameters if one.grad is not None]
        torch._foreach_lerp_(self._means, gradients, 1.0 - KEPT)
        torch._foreach_mul_(self._squares, KEPT)
        torch._foreach_addcmul_(self._squares, gradients, gradients, 1.0 - KEPT)
        variance = torch._foreach_addcmul(self._squares, self._means, self._means, -1.0)
        torch._foreach_add_(variance, MIN_SQUARE)
        torch._foreach_sqrt_(variance)
        torch._foreach_addcdiv_(weights, gradients, variance, -self.learning_rate)

    def state_dict(self) -> dict[str, Tensor]:
        """Return what is remembered as "index.part", with the learning rate (copies)."""
        state = {"learning_rate": torch.tensor(self.learning_rate, dtype=torch.float64)}
        for index, (mean, square) in enumerate(zip(self._means, self._squares, strict=True)):
            state |= {f"{index}.mean": mean.clone(), f"{index}.square": square.clone()}
        return state

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        self.learning_rate = float(state["learning_rate"])
        for index, (mean, square) in enumerate(zip(self._means, self._squares, strict=True)):
            mean.copy_(state[f"{index}.mean"])
            square.copy_(state[f"{index}.square"])
