"""From the network's parameters to chosen actions, how likely they were, and how undecided the policy is.

One class for each kind of action stands behind the same four verbs (`sample`, `mode`, `log_prob_and_entropy`,
`to_actions`):

    Categorical       one choice; forbidden ones are taken out
    MultiCategorical  one choice in each of several branches, independent of each other
    DiagGaussian      numbers, each with a normal distribution of its own
    SquashedGaussian  the same, bent into the bounds by a tanh
    Hybrid            numbers and choices at once

What the policy draws is a *raw action*; what the world obeys is an *action*. They are the same for choices. A raw
number is in [-1, 1] units and unbounded, and its likelihood is that of the number as drawn; `DiagGaussian` cuts it to
[-1, 1] and stretches it linearly to the world's bounds (facts: simapp `action_space_configs.py`, Coach `spaces.py`).
"""

from __future__ import annotations

import math
from typing import Protocol

import torch
from torch import Tensor
from torch.nn import functional

from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ActionSpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
)

FORBIDDEN_LOGIT = -1e9
"""Logit of a masked action: its probability is exactly 0 in float32, and 0 * log 0 stays finite."""
LOG_STD_RANGE = (-20.0, 3.0)
"""Where the log standard deviation is held (facts: Coach `ppo_head.py`)."""
HALF_LOG_TAU = 0.5 * math.log(2.0 * math.pi)

GAUSSIAN, SQUASHED = "gaussian", "squashed"
"""How numbers are drawn."""


class Distribution(Protocol):
    """What stands between a network and a world."""

    @property
    def spec(self) -> SingleActions:
        """What the world obeys."""
        ...

    def sample(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a raw action for each of R rows, and its log-probability (R,)."""
        ...

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the likeliest raw action for each row, and its log-probability (R,)."""
        ...

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-probability of given raw actions (R,) and the entropy of each row (R,), in nats."""
        ...

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Return what the world obeys."""
        ...


class Categorical:
    """One of A choices for each row. `params` are logits (R, A); a mask is bool (R, A), True where allowed.

    With a `floor`, no allowed choice counts as less likely than it, and the others are not lowered for that, as at AWS
    (facts: Coach `ppo_head.py`): a choice below it pulls at no weight.
    """

    def __init__(self, spec: DiscreteActions, floor: float = 0.0) -> None:
        self.spec, self.floor = spec, floor

    def sample(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a choice for each row: int64 (R,), and its log-probability (R,)."""
        log_p = self._log_probabilities(params, mask)
        drawn = torch.multinomial(log_p.exp(), 1, generator=generator)
        return drawn.squeeze(1), log_p.gather(1, drawn).squeeze(1)

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the likeliest choice for each row, int64 (R,), and its log-probability (R,)."""
        log_p, argmax_action = self._log_probabilities(params, mask).max(dim=1)
        return argmax_action, log_p

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-probability of given choices (R,) and the entropy of each row (R,), in nats."""
        log_p = self._log_probabilities(params, mask)
        entropy = -(log_p.exp() * log_p).sum(dim=1)
        return log_p.gather(1, raw_actions.unsqueeze(1)).squeeze(1), entropy

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Return what the world obeys: the choice itself."""
        return raw_actions

    def sample_greedily(
        self, params: Tensor, mask: Tensor | None, epsilon: float, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Take the likeliest choice, but with probability `epsilon` any, each as likely: as `sample`.

        The log-probability is the policy's own, as the AWS learner compares policies and not ways to explore.
        """
        log_p = self._log_probabilities(params, mask)
        allowed = torch.ones_like(log_p) if mask is None else mask.to(log_p.dtype)
        anything = torch.multinomial(allowed, 1, generator=generator).squeeze(1)
        wander = torch.rand(len(log_p), generator=generator, device=log_p.device) < epsilon
        drawn = torch.where(wander, anything, log_p.argmax(dim=1))
        return drawn, log_p.gather(1, drawn.unsqueeze(1)).squeeze(1)

    def probabilities(self, params: Tensor, mask: Tensor | None) -> Tensor:
        """Return how likely each choice is, (R, A); exactly 0 where forbidden."""
        return self._log_probabilities(params, mask).exp()

    def _log_probabilities(self, logits: Tensor, mask: Tensor | None) -> Tensor:
        if mask is not None:
            logits = logits.masked_fill(~mask, FORBIDDEN_LOGIT)
        log_p = torch.log_softmax(logits, dim=1)
        if self.floor > 0.0:
            log_p = log_p.clamp_min(math.log(self.floor))
            log_p = log_p if mask is None else log_p.masked_fill(~mask, FORBIDDEN_LOGIT)
        return log_p


class MultiCategorical:
    """One choice in each of K branches. `params` are logits (R, A) and a mask is bool (R, A), branch after branch."""

    def __init__(self, spec: MultiDiscreteActions, floor: float = 0.0) -> None:
        self.spec = spec
        self._branches = [Categorical(DiscreteActions(count), floor) for count in spec.counts]

    def sample(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw choices for each row: int64 (R, K), and their log-probability together (R,)."""
        parts = [branch.sample(logits, None, own, generator) for branch, logits, own in self._split(params, mask)]
        return _joined(parts)

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the likeliest choices for each row, int64 (R, K), and their log-probability together (R,)."""
        return _joined([branch.mode(logits, None, own) for branch, logits, own in self._split(params, mask)])

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-probability of given choices (R,) and the entropy of each row (R,), both over all branches."""
        parts = [
            branch.log_prob_and_entropy(logits, None, own, raw_actions[:, k])
            for k, (branch, logits, own) in enumerate(self._split(params, mask))
        ]
        log_prob, entropy = zip(*parts, strict=True)
        return torch.stack(log_prob).sum(dim=0), torch.stack(entropy).sum(dim=0)

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Return what the world obeys: the choices themselves."""
        return raw_actions

    def _split(self, params: Tensor, mask: Tensor | None) -> list[tuple[Categorical, Tensor, Tensor | None]]:
        counts = list(self.spec.counts)
        masks = [None] * len(counts) if mask is None else list(mask.split(counts, dim=1))
        return list(zip(self._branches, params.split(counts, dim=1), masks, strict=True))


class DiagGaussian:
    """A vector of A numbers for each row. `params` are means (R, A) in [-1, 1] units, `log_std` is (A,) or (R, A)."""

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
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a vector for each row: float32 (R, A), not cut, and its log-density (R,)."""
        std = _held(log_std).exp()
        noise = torch.randn(params.shape, generator=generator, device=params.device)
        drawn = params + std * noise
        return drawn, self._log_density(params, _held(log_std), drawn)

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the mean of each row, float32 (R, A), and its log-density (R,)."""
        return params, self._log_density(params, _held(log_std), params)

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-density of given vectors (R,) and the entropy of each row (R,), in nats."""
        held = _held(log_std)
        entropy = (held + 0.5 + HALF_LOG_TAU).sum(dim=-1)
        return self._log_density(params, held, raw_actions), entropy.expand(len(params))

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Cut to [-1, 1] and stretch to the bounds; numbers without two finite bounds pass as they are."""
        device = raw_actions.device
        cut = torch.where(self.bounded.to(device), raw_actions.clamp(-1.0, 1.0), raw_actions)
        return self._stretched(cut)

    def _stretched(self, cut: Tensor) -> Tensor:
        device = cut.device
        actions = self.centre.to(device) + self.scale.to(device) * cut
        return actions.clamp(self.low.to(device), self.high.to(device))

    @staticmethod
    def _log_density(mean: Tensor, log_std: Tensor, raw_actions: Tensor) -> Tensor:
        away = (raw_actions - mean) * torch.exp(-log_std)
        return (-0.5 * away.square() - log_std - HALF_LOG_TAU).sum(dim=1)


class SquashedGaussian(DiagGaussian):
    """A normal vector bent into (-1, 1) by a tanh, then stretched to the bounds; every number needs two finite ones.

    The raw action is the number before the tanh; its likelihood is that of the action, per [-1, 1] unit (Haarnoja et
    al., "Soft actor-critic", 2018, appendix C). The entropy has no closed form: it is the normal's, plus how far the
    tanh squeezes the raw actions at hand.

    Raises:
        SettingError: A number without bounds.
    """

    def __init__(self, spec: ContinuousActions) -> None:
        super().__init__(spec)
        if not bool(self.bounded.all()):
            raise SettingError(
                "squashed actions need finite bounds; found low {low}, high {high}. Use gaussian ones.",
                low=spec.low,
                high=spec.high,
            )

    def sample(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw a vector for each row: float32 (R, A) before the tanh, and the action's log-density (R,)."""
        drawn, log_prob = super().sample(params, log_std, mask, generator)
        return drawn, log_prob - squeeze(drawn)

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the mean before the tanh, float32 (R, A), and the action's log-density (R,)."""
        mean, log_prob = super().mode(params, log_std, mask)
        return mean, log_prob - squeeze(mean)

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the log-density of the actions (R,) and an estimate of the entropy of each row (R,), in nats."""
        log_prob, entropy = super().log_prob_and_entropy(params, log_std, mask, raw_actions)
        shrunk = squeeze(raw_actions)
        return log_prob - shrunk, entropy + shrunk

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Bend into (-1, 1) and stretch to the bounds."""
        return self._stretched(torch.tanh(raw_actions))


class Hybrid:
    """Numbers and choices at once. `params` are the means, then the logits; so are raw actions, float32 (R, A + K)."""

    def __init__(self, spec: HybridActions, floor: float = 0.0, numbers: str = GAUSSIAN) -> None:
        self.spec = spec
        self.numbers = _gaussian(spec.continuous, numbers)
        """How the numbers among them are drawn."""
        self._choices = MultiCategorical(spec.discrete, floor)
        self._width = spec.continuous.shape[0]

    def sample(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw numbers, then choices."""
        means, logits = self._split(params)
        drawn, log_density = self.numbers.sample(means, log_std, None, generator)
        chosen, log_prob = self._choices.sample(logits, None, mask, generator)
        return torch.cat([drawn, chosen.float()], dim=1), log_density + log_prob

    def mode(self, params: Tensor, log_std: Tensor | None, mask: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the means and the likeliest choices."""
        means, logits = self._split(params)
        mean, log_density = self.numbers.mode(means, log_std, None)
        chosen, log_prob = self._choices.mode(logits, None, mask)
        return torch.cat([mean, chosen.float()], dim=1), log_density + log_prob

    def log_prob_and_entropy(
        self, params: Tensor, log_std: Tensor | None, mask: Tensor | None, raw_actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return log-densities plus log-probabilities (R,), and entropies likewise (R,)."""
        means, logits = self._split(params)
        drawn, chosen = raw_actions[:, : self._width], raw_actions[:, self._width :].long()
        log_density, spread = self.numbers.log_prob_and_entropy(means, log_std, None, drawn)
        log_prob, entropy = self._choices.log_prob_and_entropy(logits, None, mask, chosen)
        return log_density + log_prob, spread + entropy

    def to_actions(self, raw_actions: Tensor) -> Tensor:
        """Bring the numbers into their bounds; choices stay."""
        numbers = self.numbers.to_actions(raw_actions[:, : self._width])
        return torch.cat([numbers, raw_actions[:, self._width :]], dim=1)

    def _split(self, params: Tensor) -> tuple[Tensor, Tensor]:
        return params[:, : self._width], params[:, self._width :]


def distribution_for(actions: ActionSpec, floor: float = 0.0, numbers: str = GAUSSIAN) -> Distribution:
    """Return the distribution that fits a world's actions.

    Args:
        actions: What the world obeys.
        floor: Least probability of a choice.
        numbers: GAUSSIAN or SQUASHED, how numbers are drawn.

    Raises:
        SettingError: Actions of several kinds of agents (each needs a policy of its own), or squashed ones unbounded.
    """
    if isinstance(actions, DiscreteActions):
        return Categorical(actions, floor)
    if isinstance(actions, MultiDiscreteActions):
        return MultiCategorical(actions, floor)
    if isinstance(actions, HybridActions):
        return Hybrid(actions, floor, numbers)
    if isinstance(actions, ContinuousActions):
        return _gaussian(actions, numbers)
    raise SettingError(
        "{actions}: one policy cannot act for several kinds of agents; expected one for each group.", actions=actions
    )


def params_width(actions: ActionSpec) -> int:
    """Return how many parameters a network gives: one for each choice of each branch, one for each number.

    >>> params_width(HybridActions(ContinuousActions((0.0,), (1.0,)), MultiDiscreteActions((3, 2))))
    6
    """
    if isinstance(actions, DiscreteActions):
        return actions.count
    if isinstance(actions, MultiDiscreteActions):
        return sum(actions.counts)
    if isinstance(actions, HybridActions):
        return params_width(actions.continuous) + params_width(actions.discrete)
    return actions.shape[0]


def numbers_width(actions: ActionSpec) -> int:
    """Return how many numbers, each with a standard deviation, there are among the actions."""
    if isinstance(actions, HybridActions):
        return actions.continuous.shape[0]
    return actions.shape[0] if isinstance(actions, ContinuousActions) else 0


def _gaussian(actions: ContinuousActions, numbers: str) -> DiagGaussian:
    return SquashedGaussian(actions) if numbers == SQUASHED else DiagGaussian(actions)


def _joined(parts: list[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
    chosen, log_prob = zip(*parts, strict=True)
    return torch.stack(chosen, dim=1), torch.stack(log_prob).sum(dim=0)


def squeeze(raw: Tensor) -> Tensor:
    """Return the logarithm of how much a tanh shrinks lengths at raw numbers (R, A), summed over A; never above 0."""
    return (2.0 * (math.log(2.0) - raw - functional.softplus(-2.0 * raw))).sum(dim=1)


def _held(log_std: Tensor | None) -> Tensor:
    assert log_std is not None, "numbers have a log standard deviation"
    return log_std.clamp(*LOG_STD_RANGE)
