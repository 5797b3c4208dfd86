"""What a policy looks at, and how sure it is: for every policy that `load_policy` returns, over named observations.

Begin with `attribute`. Three views of one decision:

    confidence            how much more the chosen option is to it than the second best
    integrated gradients  how much every pixel, beam and number added to the decision; the parts add up to the whole
    Grad-CAM              where in a picture the last convolution found what it decided by; coarse, never negative

What is explained is a *score*: of a choice its logit (or worth) above the mean of all options, for a logit alone means
nothing; of a number its size in bounds, -1 to 1, whichever way it points.

Sources: Sundararajan, Taly and Yan, "Axiomatic attribution for deep networks", 2017 (integrated gradients and
completeness); Selvaraju et al., "Grad-CAM", 2017.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from racecraft.algorithms.explainable import Explainable, Scores
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array

STEPS = 32
"""Places on the way from the baseline at which gradients are taken."""
AT_ONCE = 2048
"""Rows times steps that go through the network in one pass."""
CHANGED_NUMBER = 0.1
"""A number that moves by more than this, of its way from -1 to 1, is another decision."""
SAME_ANSWER = 1e-3
"""How far scores of the same picture as bytes and as numbers may lie apart."""


class AttentionError(UserInputError):
    """A policy cannot be looked into, or not at what was asked."""


@dataclass(frozen=True)
class ExplainTarget:
    """Which part of the action is explained."""

    part: int = 0
    """The numbers first, then the choices: of a car that steers by numbers 0 is steering and 1 is speed."""
    option: int | None = None
    """Of a choice: which option; None: the one that is taken."""


TAKEN = ExplainTarget()
"""The first number, or the option that is taken."""


@dataclass(frozen=True)
class Confidence:
    """How sure a policy is of R rows."""

    best: Array
    """int64 (R,): the option taken; of numbers 0."""
    second: Array
    """int64 (R,): the next best."""
    share: Array
    """(R,) probability of the best, 0 to 1; of worths and numbers NaN."""
    second_share: Array
    """(R,) likewise of the second."""
    margin: Array
    """(R,) score of the best above the second: nats for logits, reward units for worths; of numbers NaN."""
    numbers: Array
    """(R, D) the middle of each number, in bounds, -1 to 1."""
    deviations: Array
    """(R, D) how far each is spread, in the same units."""

    @property
    def gap(self) -> Array:
        """(R,) probability of the best above that of the second; NaN where there are none."""
        return self.share - self.second_share


@dataclass(frozen=True)
class Attribution:
    """What R decisions were made of."""

    confidence: Confidence
    score: Array
    """(R,) what was explained; see the head of the file for its units."""
    baseline: Array
    """(R,) the same score where nothing is to be seen."""
    parts: Mapping[str, Array]
    """Integrated gradients by observation, (R, *shape as the network is fed); they add up to score - baseline."""
    maps: Mapping[str, Array]
    """Grad-CAM by picture, (R, H, W), never negative; empty for networks without convolutions."""

    def heat(self, name: str) -> Array:
        """Return how much every pixel of a picture counts, (R, H, W), never negative: its channels put together."""
        parts = np.abs(self.parts[name])
        return parts.sum(axis=-1) if parts.ndim == 4 else parts


@dataclass(frozen=True)
class Recording:
    """What a policy was fed in R rows, its memory included: enough to explain them later, many ticks at once."""

    inputs: Mapping[str, Tensor]
    """float32 (R, …) by name."""
    pictures: tuple[str, ...]
    """Which of them are pictures, (R, H, W) or (R, H, W, C)."""

    @classmethod
    def now(cls, policy: Any, observations: Mapping[str, Array]) -> Recording:
        """Return what a policy would be fed were this seen next; nothing is remembered.

        Raises:
            AttentionError: The policy does not show what it decides by.
        """
        clear = transparent(policy)
        fed = clear.inputs(observations)
        _require_same_answer(clear, observations, fed)
        return cls(fed, tuple(name for name in fed if name in observations and is_picture(observations[name])))

    @classmethod
    def joined(cls, ticks: Sequence[Recording]) -> Recording:
        """Return the rows of all ticks as one."""
        fed = {name: torch.cat([tick.inputs[name] for tick in ticks]) for name in ticks[0].inputs}
        return cls(fed, ticks[0].pictures)

    def instead(self, policy: Any, observations: Mapping[str, Array]) -> Recording:
        """Return the same rows, their memory too, but with other observations (R, …) of some names in their place."""
        rest = {
            name: np.zeros(tuple(part.shape), np.float32) for name, part in self.inputs.items()
        }  # asked for, not kept
        fed = transparent(policy).inputs({**rest, **observations})
        return Recording({**self.inputs, **{name: fed[name] for name in observations}}, self.pictures)


class SeeingPolicy:
    """A policy that plays on as ever and keeps what it was fed, tick by tick, with its memory of that moment.

    Args:
        policy: Whose it is.
    """

    def __init__(self, policy: Any) -> None:
        self.policy = policy
        self._ticks: list[Recording] = []

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return the policy's actions (R, …)."""
        self._ticks.append(Recording.now(self.policy, observations))
        actions: Array = self.policy.act(observations, action_mask)
        return actions

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.policy.reset_state(rows)

    @property
    def seen(self) -> Recording:
        """All that was fed so far, the ticks' rows end to end."""
        return Recording.joined(self._ticks)


def attribute(
    policy: Any,
    observations: Mapping[str, Array] | Recording,
    question: ExplainTarget = TAKEN,
    steps: int = STEPS,
    action_mask: Array | None = None,
) -> Attribution:
    """Explain what a policy would decide were this seen next; nothing is remembered.

    Args:
        policy: From `load_policy`, or any `Explainable` one.
        observations: (R, …) by name, in the world's own types; or what it was fed earlier.
        question: Which part of the action.
        steps: Places at which gradients are taken; more come nearer to completeness.
        action_mask: bool (R, A), True where an option is allowed, or None.

    Raises:
        AttentionError: The policy does not show what it decides by, or has no such part.
    """
    clear = transparent(policy)
    seen = observations if isinstance(observations, Recording) else Recording.now(policy, observations)
    mask = _selected(clear, seen.inputs, question, action_mask)
    empty = _empty(seen)
    parts = _integrated(clear, seen.inputs, empty, mask, question.part, steps)
    with torch.no_grad():
        scores = clear.scores(seen.inputs)
        whole, nothing = (_score(clear.scores(rows), question.part, mask) for rows in (seen.inputs, empty))
    return Attribution(
        confidence=_confidence(scores, action_mask, question.part),
        score=_array(whole),
        baseline=_array(nothing),
        parts={name: _array(part) for name, part in parts.items()},
        maps={name: _array(part) for name, part in _grad_cam(clear, seen, mask, question.part).items()},
    )


def confidence(
    policy: Any, observations: Mapping[str, Array] | Recording, action_mask: Array | None = None
) -> Confidence:
    """Return how sure a policy is of its first choice; see `attribute`, whose pictures take longer."""
    clear = transparent(policy)
    fed = observations.inputs if isinstance(observations, Recording) else clear.inputs(observations)
    with torch.no_grad():
        return _confidence(clear.scores(fed), action_mask, 0)


def changed(before: Confidence, after: Confidence) -> Array:
    """Return which rows (bool (R,)) decide otherwise: another option, or a number CHANGED_NUMBER away."""
    away = np.abs(before.numbers - after.numbers).max(axis=1, initial=0.0)
    return np.asarray((before.best != after.best) | (away > CHANGED_NUMBER))


def transparent(policy: Any) -> Explainable:
    """Return the policy within a loaded one that shows what it decides by.

    Raises:
        AttentionError: There is none.
    """
    inner = policy
    while not isinstance(inner, Explainable):
        inner = getattr(inner, "policy", None)
        if inner is None:
            raise AttentionError(
                "{type_name} does not show what it decides by; expected a policy of one network, as "
                "load_policy returns it. Of a run with several groups take the policy of one of them.",
                type_name=type(policy).__name__,
            )
    return inner


# ---- the score ----------------------------------------------------------------------------------------------------


def _selected(clear: Explainable, fed: Mapping[str, Tensor], question: ExplainTarget, mask: Array | None) -> Tensor:
    """Return what is asked of each row (R,): which option, or which way the number points (-1 or 1)."""
    with torch.no_grad():
        scores = clear.scores(fed)
    width, count = scores.numbers.shape[1], len(scores.branches)
    if not 0 <= question.part < width + count:
        raise AttentionError(
            "part {part} of the action was asked for; expected 0 to {width}: {width_2} numbers, then {count} choices.",
            part=question.part,
            width=width + count - 1,
            width_2=width,
            count=count,
        )
    if question.part < width:
        number = scores.numbers[:, question.part]
        return torch.where(number < 0, -torch.ones_like(number), torch.ones_like(number))
    branch = _allowed(scores, question.part - width, mask)
    if question.option is None:
        return branch.argmax(dim=1)
    if not 0 <= question.option < branch.shape[1]:
        raise AttentionError(
            "option {option} was asked for; expected 0 to {shape}.", option=question.option, shape=branch.shape[1] - 1
        )
    return torch.full((len(branch),), question.option, device=branch.device)


def _score(scores: Scores, part: int, mask: Tensor) -> Tensor:
    """Return the score (R,) that is explained."""
    width = scores.numbers.shape[1]
    if part < width:
        return scores.numbers[:, part] * mask
    branch = scores.branches[part - width]
    return branch.gather(1, mask.unsqueeze(1)).squeeze(1) - branch.mean(dim=1)


def _allowed(scores: Scores, branch: int, mask: Array | None) -> Tensor:
    """Return a branch's scores with forbidden options below all others."""
    found = scores.branches[branch]
    if mask is None:
        return found
    before = sum(part.shape[1] for part in scores.branches[:branch])
    allowed = torch.from_numpy(mask[:, before : before + found.shape[1]]).to(found.device)
    return found.masked_fill(~allowed, -torch.inf)


def _confidence(scores: Scores, mask: Array | None, part: int) -> Confidence:
    rows, width = scores.numbers.shape
    first = second = np.zeros(rows, np.int64)
    share = second_share = margin = np.full(rows, np.nan, np.float32)
    if scores.branches:
        branch = _allowed(scores, max(0, part - width), mask)
        order = branch.argsort(dim=1, descending=True)[:, [0, min(1, branch.shape[1] - 1)]]
        first, second = _array(order).T
        best, next_ = _array(branch.gather(1, order)).T
        margin = best - next_
        if not scores.are_q_values:
            share, second_share = _array(torch.softmax(branch, dim=1).gather(1, order)).T
    return Confidence(first, second, share, second_share, margin, _array(scores.numbers), _array(scores.deviations))


# ---- integrated gradients -----------------------------------------------------------------------------------------


def _empty(seen: Recording) -> dict[str, Tensor]:
    """Return what is fed where nothing is to be seen: a picture of one even grey, as bright on the whole; zeros."""
    empty = {}
    for name, part in seen.inputs.items():
        if name in seen.pictures:
            empty[name] = part.mean(dim=(1, 2), keepdim=True).expand_as(part).contiguous()
        else:
            empty[name] = torch.zeros_like(part)
    return empty


def _integrated(
    clear: Explainable,
    fed: Mapping[str, Tensor],
    empty: Mapping[str, Tensor],
    mask: Tensor,
    part: int,
    steps: int,
) -> dict[str, Tensor]:
    """Return integrated gradients by name, the midpoint rule over so many steps."""
    rows = len(mask)
    found: dict[str, list[Tensor]] = {name: [] for name in fed}
    for first in range(0, rows, max(1, AT_ONCE // steps)):
        some = slice(first, first + max(1, AT_ONCE // steps))
        for name, gradient in _mean_gradients(clear, fed, empty, mask, part, steps, some).items():
            found[name].append((fed[name][some] - empty[name][some]) * gradient)
    return {name: torch.cat(parts) for name, parts in found.items()}


def _mean_gradients(
    clear: Explainable,
    fed: Mapping[str, Tensor],
    empty: Mapping[str, Tensor],
    mask: Tensor,
    part: int,
    steps: int,
    some: slice,
) -> dict[str, Tensor]:
    """Return the mean gradient of the score along the straight way from the baseline, for some rows."""
    count = len(mask[some])
    shares = (torch.arange(steps, device=mask.device) + 0.5) / steps
    way = {}
    for name, whole in fed.items():
        from_, to = empty[name][some].unsqueeze(0), whole[some].unsqueeze(0)
        along = shares.view(steps, *[1] * whole.dim())
        way[name] = (from_ + along * (to - from_)).flatten(0, 1).requires_grad_(True)
    with torch.enable_grad():
        total = _score(clear.scores(way), part, mask[some].repeat(steps)).sum()
        found = torch.autograd.grad(total, list(way.values()), allow_unused=True)
    return {
        name: _or_zeros(one, way[name]).unflatten(0, (steps, count)).mean(dim=0)
        for name, one in zip(way, found, strict=True)
    }


# ---- Grad-CAM -----------------------------------------------------------------------------------------------------


def _grad_cam(clear: Explainable, seen: Recording, mask: Tensor, part: int) -> dict[str, Tensor]:
    """Return Grad-CAM for each picture that goes through convolutions of its own."""
    found = {}
    for name, module in _modules_of(clear.encoder, seen.pictures).items():
        maps: list[Tensor] = []
        hooks = [leaf.register_forward_hook(_keeper(maps)) for leaf in _from_first_convolution(module)]
        try:
            with torch.enable_grad():
                total = _score(clear.scores(seen.inputs), part, mask).sum()
                if not maps:
                    continue
                (gradient,) = torch.autograd.grad(total, [maps[-1]], allow_unused=True)
        finally:
            for hook in hooks:
                hook.remove()
        height, width = seen.inputs[name].shape[1:3]
        found[name] = cam(maps[-1].detach(), _or_zeros(gradient, maps[-1]), (height, width))
    return found


def cam(maps: Tensor, gradient: Tensor, size: tuple[int, int]) -> Tensor:
    """Return Grad-CAM (R, H, W) of feature maps (R, C, h, w) and the score's gradient by them, at a size.

    Each map counts by the mean of its gradient; what speaks against the decision is left out.
    """
    weight = gradient.mean(dim=(2, 3), keepdim=True)
    coarse = torch.relu((weight * maps).sum(dim=1, keepdim=True))
    return functional.interpolate(coarse, size=size, mode="bilinear", align_corners=False).squeeze(1)


def _modules_of(eyes: nn.Module, pictures: Sequence[str]) -> dict[str, nn.Module]:
    """Return the network behind each picture; of a user's own network the whole, where it sees one picture only."""
    embedders, names = getattr(eyes, "embedders", None), getattr(eyes, "names", ())
    if embedders is not None:
        return {name: part for name, part in zip(names, embedders, strict=True) if name in pictures}
    return {pictures[0]: eyes} if len(pictures) == 1 else {}


def _from_first_convolution(module: nn.Module) -> list[nn.Module]:
    """Return the leaves of a network from its first convolution on; none where it has none."""
    leaves = [leaf for leaf in module.modules() if not any(leaf.children())]
    first = next((k for k, leaf in enumerate(leaves) if isinstance(leaf, nn.Conv2d)), len(leaves))
    return leaves[first:]


def _keeper(maps: list[Tensor]) -> Any:
    """Return a hook that keeps outputs that are still maps; the last of them is what Grad-CAM looks at."""

    def keep(_module: nn.Module, _inputs: Any, output: Any) -> None:
        if isinstance(output, Tensor) and output.dim() == 4:
            maps.append(output)

    return keep


# ---- small things -------------------------------------------------------------------------------------------------


def is_picture(array: Array) -> bool:
    """Tell whether an observation (R, …) goes through convolutions, as `networks.is_image` tells it of its spec.

    >>> is_picture(np.zeros((1, 30, 40), np.uint8)), is_picture(np.zeros((1, 64), np.float32))
    (True, False)
    """
    return array.ndim == 4 or (array.ndim == 3 and array.dtype == np.uint8)


def _require_same_answer(clear: Explainable, observations: Mapping[str, Array], fed: Mapping[str, Tensor]) -> None:
    """Refuse a network that takes bytes and numbers for different pictures: its gradients would be of another one."""
    if not any(array.dtype == np.uint8 for name, array in observations.items() if name in fed):
        return
    device = next(iter(fed.values())).device
    raw = {
        name: torch.from_numpy(observations[name]).to(device)
        if name in observations and observations[name].shape == tuple(part.shape)
        else part
        for name, part in fed.items()
    }
    with torch.no_grad():
        as_bytes, as_numbers = clear.scores(raw), clear.scores(fed)
    pairs = zip((as_bytes.numbers, *as_bytes.branches), (as_numbers.numbers, *as_numbers.branches), strict=True)
    away = max(float((one - other).abs().max()) if one.numel() else 0.0 for one, other in pairs)
    if away > SAME_ANSWER:
        raise AttentionError(
            "the network answers differently (by {away:.3g}) to the same picture as uint8 and as float32 of 0 to 255; "
            "expected a forward that scales by value, not by type. Divide by 255 in both cases.",
            away=away,
        )


def _or_zeros(gradient: Tensor | None, of: Tensor) -> Tensor:
    """Return a gradient; zeros where nothing depends on that tensor."""
    return torch.zeros_like(of) if gradient is None else gradient


def _array(tensor: Tensor) -> Array:
    array: Array = tensor.detach().cpu().numpy()
    return array
