"""From the network's numbers to chosen actions, how likely they were, and how undecided the policy is.

Two kinds stand side by side behind the same four verbs: `Choices` for discrete actions (a categorical distribution,
with forbidden actions taken out) and `Commands` for continuous ones (an independent normal distribution for each
number). What the policy draws is called a *sample*; what the world obeys is an *action*. They are the same for choices.
For commands the sample is in [-1, 1] units and unbounded, its likelihood is that of the sample as drawn, and the action
is the sample cut to [-1, 1] and stretched linearly to the world's bounds (facts: simapp `action_space_configs.py`,
Coach `spaces.py`).
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from racecraft.contract.world import ActionSpec, ContinuousActions, DiscreteActions

FORBIDDEN_LOGIT = -1e9
"""Logit of a masked action: its probability is exactly 0 in float32, and 0 * log 0 stays finite."""
LOG_STD_RANGE = (-20.0, 3.0)
"""Where the log standard deviation is held (facts: Coach `ppo_head.py`)."""
HALF_LOG_TAU = 0.5 * math.log(2.0 * math.pi)


class Choices:
    """One of A choices for each row. `numbers` are logits (R, A); a mask is bool (R, A), True where allowed.

    With a `floor`, no allowed choice counts as less likely than it, and the others are not lowered for that, as at AWS
    (facts: Coach `ppo_head.py`): a choice below it pulls at no weight.
    """

    def __init__(self, spec: DiscreteActions, floor: float = 0.0) -> None:
        self.spec, self.floor = spec, floor

    def sample(
        self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a choice for each row: int64 (R,), and its log-probability (R,)."""
        log_p = self._log_probabilities(numbers, mask)
        drawn = torch.multinomial(log_p.exp(), 1, generator=generator)
        return drawn.squeeze(1), log_p.gather(1, drawn).squeeze(1)

    def best(self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the likeliest choice for each row, int64 (R,), and its log-probability (R,)."""
        log_p, best = self._log_probabilities(numbers, mask).max(dim=1)
        return best, log_p

    def judge(
        self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None, samples: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-probability of given samples (R,) and the entropy of each row (R,), in nats."""
        log_p = self._log_probabilities(numbers, mask)
        entropy = -(log_p.exp() * log_p).sum(dim=1)
        return log_p.gather(1, samples.unsqueeze(1)).squeeze(1), entropy

    def to_actions(self, samples: Tensor) -> Tensor:
        """Return what the world obeys: the choice itself."""
        return samples

    def sample_greedily(
        self, numbers: Tensor, mask: Tensor | None, epsilon: float, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Take the likeliest choice, but with probability `epsilon` any, each as likely: as `sample`.

        The log-probability is the policy's own, as the AWS learner compares policies and not ways to explore.
        """
        log_p = self._log_probabilities(numbers, mask)
        allowed = torch.ones_like(log_p) if mask is None else mask.to(log_p.dtype)
        anything = torch.multinomial(allowed, 1, generator=generator).squeeze(1)
        wander = torch.rand(len(log_p), generator=generator, device=log_p.device) < epsilon
        drawn = torch.where(wander, anything, log_p.argmax(dim=1))
        return drawn, log_p.gather(1, drawn.unsqueeze(1)).squeeze(1)

    def chances(self, numbers: Tensor, mask: Tensor | None) -> Tensor:
        """Return how likely each choice is, (R, A); exactly 0 where forbidden."""
        return self._log_probabilities(numbers, mask).exp()

    def _log_probabilities(self, logits: Tensor, mask: Tensor | None) -> Tensor:
        if mask is not None:
            logits = logits.masked_fill(~mask, FORBIDDEN_LOGIT)
        log_p = torch.log_softmax(logits, dim=1)
        if self.floor > 0.0:
            log_p = log_p.clamp_min(math.log(self.floor))
            log_p = log_p if mask is None else log_p.masked_fill(~mask, FORBIDDEN_LOGIT)
        return log_p


class Commands:
    """A vector of A numbers for each row. `numbers` are means (R, A) in [-1, 1] units, `log_std` is (A,)."""

    def __init__(self, spec: ContinuousActions) -> None:
        low = torch.tensor(spec.low, dtype=torch.float32)
        high = torch.tensor(spec.high, dtype=torch.float32)
        self.spec = spec
        self.bounded = torch.isfinite(low) & torch.isfinite(high)
        one = torch.ones_like(low)
        self.low, self.high = low, high
        self.scale = torch.where(self.bounded, (high - low) / 2, one)
        self.centre = torch.where(self.bounded, (high + low) / 2, 0 * one)

    def sample(
        self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a vector for each row: float32 (R, A), not cut, and its log-density (R,)."""
        std = _held(log_std).exp()
        noise = torch.randn(numbers.shape, generator=generator, device=numbers.device)
        drawn = numbers + std * noise
        return drawn, self._log_density(numbers, _held(log_std), drawn)

    def best(self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the mean of each row, float32 (R, A), and its log-density (R,)."""
        return numbers, self._log_density(numbers, _held(log_std), numbers)

    def judge(
        self, numbers: Tensor, log_std: Tensor | None, mask: Tensor | None, samples: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-density of given samples (R,) and the entropy of each row (R,), in nats."""
        held = _held(log_std)
        entropy = (held + 0.5 + HALF_LOG_TAU).sum()
        return self._log_density(numbers, held, samples), entropy.expand(len(numbers))

    def to_actions(self, samples: Tensor) -> Tensor:
        """Cut samples to [-1, 1] and stretch them to the bounds; numbers without two finite bounds pass as they are."""
        device = samples.device
        cut = torch.where(self.bounded.to(device), samples.clamp(-1.0, 1.0), samples)
        actions = self.centre.to(device) + self.scale.to(device) * cut
        return actions.clamp(self.low.to(device), self.high.to(device))

    @staticmethod
    def _log_density(mean: Tensor, log_std: Tensor, samples: Tensor) -> Tensor:
        away = (samples - mean) * torch.exp(-log_std)
        return (-0.5 * away.square() - log_std - HALF_LOG_TAU).sum(dim=1)


Distribution = Choices | Commands


def distribution_for(actions: ActionSpec, floor: float = 0.0) -> Distribution:
    """Return the distribution that fits a world's actions; `floor` is for choices."""
    return Choices(actions, floor) if isinstance(actions, DiscreteActions) else Commands(actions)


def _held(log_std: Tensor | None) -> Tensor:
    assert log_std is not None, "continuous actions have a log standard deviation"
    return log_std.clamp(*LOG_STD_RANGE)
