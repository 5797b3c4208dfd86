"""Adam: every weight steps along the running mean of its gradient, over the root of that of the square.

Source: Kingma and Ba, "Adam: a method for stochastic optimization", 2015. The arithmetic is PyTorch's own, by its
functional door: the class of the same name brings PyTorch's compiler along when it is made, 1.3 s of every start
(PyTorch 2.13) for what is never compiled here.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.optim.adam import adam

from racecraft.contract.world import Array

BETA_1 = 0.9
"""What stays of the mean gradient at a step."""
BETA_2 = 0.999
"""What stays of the mean square."""


class Moments(NamedTuple):
    """What is remembered of one parameter; written in place. Checkpoints know the parts by these names."""

    step: Tensor
    """Steps taken, float32 ()."""
    exp_avg: Tensor
    """Running mean of the gradient, in the parameter's shape."""
    exp_avg_sq: Tensor
    """Running mean of its square."""


class Adam:
    """Steps parameters by the gradients they carry.

    Args:
        parameters: What is stepped, in place; one without a gradient is left alone.
        learning_rate: How long a step is.
        epsilon: Keeps the root from nought.
        form: `paper` adds epsilon to the root of the second moment without its bias; `tensorflow` to that of the raw
            one ("epsilon hat" in the paper's section 2), which is smaller, and so are the first steps.
    """

    def __init__(
        self, parameters: Iterable[nn.Parameter], learning_rate: float, epsilon: float, form: str = "paper"
    ) -> None:
        self.learning_rate = learning_rate
        """How long a step is; may be set between steps."""
        self._parameters, self._epsilon, self._form = list(parameters), epsilon, form
        self._moments: dict[int, Moments] = {}

    @torch.no_grad()
    def step(self, part: Collection[int] | None = None) -> None:
        """Take one step: of all parameters, or of those at some places among them."""
        places = range(len(self._parameters)) if part is None else part
        owned = [(index, self._parameters[index]) for index in places]
        due = [(index, one, one.grad) for index, one in owned if one.grad is not None]
        if not due:
            return
        moments = [self._moments_of(index) for index, _, _ in due]
        adam(
            [one for _, one, _ in due],
            [gradient for _, _, gradient in due],
            [kept.exp_avg for kept in moments],
            [kept.exp_avg_sq for kept in moments],
            [],
            [kept.step for kept in moments],
            fused=True, amsgrad=False, beta1=BETA_1, beta2=BETA_2, lr=self.learning_rate, weight_decay=0.0,
            eps=self._epsilon_now(moments[0]), maximize=False,
        )  # fmt: skip

    @torch.no_grad()
    def step_by_half(self, index: int, half: Tensor) -> None:
        """Step one parameter, on a processor, by the gradient of its copy in bfloat16, and round the copy anew.

        The same numbers as `step` to the last digits, in one pass over memory.

        Args:
            index: Which of the parameters.
            half: The copy, laid in memory as the parameter is; it carries the gradient.
        """
        # Numba comes in where it is needed: whoever learns in float32 starts without.
        from racecraft.algorithms.kernels.half_adam import step_block, step_weights

        assert half.grad is not None, "only what carries a gradient is stepped"
        kept, epsilon = self._moments_of(index), self._epsilon_now(self._moments_of(index))
        kept.step.add_(1.0)
        count = int(kept.step)
        gradient = half.grad if half.grad.stride() == half.stride() else torch.empty_like(half).copy_(half.grad)
        scales = (BETA_1, BETA_2, 1.0 / math.sqrt(1.0 - BETA_2**count), epsilon)
        taken = step_block if torch.get_num_threads() == 1 else step_weights
        taken(
            *(_numbers(part) for part in (self._parameters[index], half, gradient, kept.exp_avg, kept.exp_avg_sq)),
            *(np.float32(scale) for scale in scales),
            np.float32(self.learning_rate / (1.0 - BETA_1**count)),
        )

    def state_dict(self) -> dict[str, Tensor]:
        """Return what is remembered as "index.part", with the learning rate (copies)."""
        state = {
            f"{index}.{name}": part.clone()
            for index, kept in self._moments.items()
            for name, part in kept._asdict().items()
        }
        return {**state, "learning_rate": torch.tensor(self.learning_rate, dtype=torch.float64)}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        self.learning_rate = float(state["learning_rate"])
        self._moments.clear()
        for name, part in state.items():
            index, _, what = name.partition(".")
            if what:
                getattr(self._moments_of(int(index)), what).copy_(part)

    def _moments_of(self, index: int) -> Moments:
        """Return what is remembered of a parameter; nothing yet is zeros."""
        if index not in self._moments:
            one = self._parameters[index]
            self._moments[index] = Moments(
                torch.zeros((), device=one.device), torch.zeros_like(one.data), torch.zeros_like(one.data)
            )
        return self._moments[index]

    def _epsilon_now(self, kept: Moments) -> float:
        """Return the epsilon with which the paper's form takes this one's coming step; all weights began together."""
        if self._form == "paper":
            return self._epsilon
        return self._epsilon / math.sqrt(1.0 - BETA_2 ** (1 + int(kept.step)))


def _numbers(part: Tensor) -> Array:
    """Return a dense tensor's numbers in the order of its memory, (W,), in place; of bfloat16 the bits, uint16."""
    flat = part.detach().as_strided((part.numel(),), (1,))
    numbers: Array = flat.view(torch.int16).numpy().view(np.uint16) if part.dtype == torch.bfloat16 else flat.numpy()
    return numbers
