"""What a policy saw, made of it and decided, picture after picture: what films, pages and tables of a look are made of.

Begin with `look_at`. A lap, a film and a folder of pictures all end as a `SaliencySeries`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecraft.analysis.attribution import STEPS, TAKEN, AttentionError, Confidence, ExplainTarget, Recording, attribute
from racecraft.contract.world import Array, ContinuousActions, DiscreteActions

SHARPEST = 99.5
"""Heat of this percentile of all pixels is drawn brightest: one spark does not darken a whole lap."""
EQUAL = 1e-6
"""Sureness that varies by less, of its size, does not vary."""
CAR_NUMBERS = ("steering", "speed")
"""What the numbers of a car's actions are, in order."""

HEAT = "inferno"
"""Colours of what is looked at: they grow lighter with it, for every eye and on paper."""


@dataclass(frozen=True, eq=False)
class Along:
    """A line along T pictures."""

    values: Array
    """(T,)."""
    spread: Array | None
    """(T,) how far values are spread around the line, where that is to be drawn."""
    label: str
    """What the line is."""
    told: Sequence[str]
    """Each value as it is said."""


@dataclass(frozen=True, eq=False)
class SaliencySeries:
    """T pictures that a policy decided by."""

    name: str
    """Of the observation."""
    frames: Array
    """(T, H, W) uint8 grey, as it saw them; of a stack the newest."""
    heat: Array
    """(T, H, W), never negative: integrated gradients of every pixel, without sign."""
    cam: Array | None
    """(T, H, W), never negative: Grad-CAM; None for networks without convolutions."""
    confidence: Confidence
    """Of each picture."""
    actions: Any
    """What it decides."""
    others: Mapping[str, Array] = field(default_factory=dict)
    """Of every other observation, a LiDAR's say, (T, L), never negative: integrated gradients of its numbers."""

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def senses(self) -> dict[str, float]:
        """How much of its decisions came of each observation, shares of 1 over all pictures, the largest first."""
        counted = {self.name: float(self.heat.sum()), **{name: float(part.sum()) for name, part in self.others.items()}}
        total = sum(counted.values()) or 1.0
        return {name: counted[name] / total for name in sorted(counted, key=lambda one: -counted[one])}

    @property
    def labels(self) -> tuple[str, ...]:
        """What the options are called; numbers where nobody named them."""
        if not isinstance(self.actions, DiscreteActions):
            return ()
        return self.actions.labels or tuple(str(k) for k in range(self.actions.count))

    @property
    def confidence_values(self) -> tuple[Array, str]:
        """How sure it was, (T,), and what that number is; higher is surer but for a spread."""
        confidence = self.confidence
        if np.isfinite(confidence.gap).all() and len(confidence.gap):
            return 100.0 * confidence.gap, "best above second best (% of probability)"
        if np.isfinite(confidence.margin).all():
            return confidence.margin, "best above second best (worth, in reward)"
        return confidence.deviations[:, 0], f"spread of {self.number_name(0)} (of its range, -1 to 1)"

    @property
    def has_constant_confidence(self) -> bool:
        """Whether it is as sure at every picture: one that learned a single spread for all of them."""
        values, _ = self.confidence_values
        return bool(np.ptp(values) <= EQUAL * np.abs(values).max(initial=1e-12)) if len(values) else True

    @property
    def along(self) -> Along:
        """What is worth a line along the pictures: how sure it was.

        Of numbers of which it is as sure everywhere that line would be flat; there it is the first number itself.
        """
        if self.labels or not self.has_constant_confidence:
            values, words = self.confidence_values
            return Along(values, None, words, [f"{value:.3g}" for value in values])
        spread, name = self.confidence.deviations[:, 0], self.number_name(0)
        up = ", up: left" if name == CAR_NUMBERS[0] else ""
        words = f"{name}{up}; spread \u00b1{spread.mean():.2g} everywhere"
        chosen = [self._number(row, 0)[2] for row in range(len(self))]
        return Along(np.clip(self.confidence.numbers[:, 0], -1.0, 1.0), spread, words, chosen)

    @property
    def least_confident(self) -> Array:
        """Pictures in the order of doubt, the least sure first, (T,)."""
        values, name = self.confidence_values
        return np.argsort(-values if name.startswith("spread") else values, kind="stable")

    def number_name(self, which: int) -> str:
        """Return what a number of the actions is called."""
        return CAR_NUMBERS[which] if which < len(CAR_NUMBERS) else f"number {which}"

    def decision(self, row: int) -> list[tuple[str, float, str]]:
        """Return what it decided at a picture: (what, share of a bar 0 to 1, in words), two lines."""
        one = self.confidence
        if self.labels:
            first, second = int(one.best[row]), int(one.second[row])
            if np.isfinite(one.share[row]):
                shares = float(one.share[row]), float(one.second_share[row])
                words = [f"{100 * share:.0f} %" for share in shares]
            else:
                shares, words = (1.0, 0.0), ["best", f"worth {one.margin[row]:.2g} less"]
            return [
                (self.labels[k], share, word) for k, share, word in zip((first, second), shares, words, strict=True)
            ]
        return [self._number(row, which) for which in range(min(2, one.numbers.shape[1]))]

    def facts(self, row: int) -> dict[str, Any]:
        """Return what it decided at a picture as plain values: numbers in bounds, -1 to 1; shares from 0 to 1."""
        one = self.confidence
        if not self.labels:
            return {self.number_name(k): float(value) for k, value in enumerate(one.numbers[row])}
        return {
            "chosen": self.labels[int(one.best[row])], "chosen_share": float(one.share[row]),
            "second": self.labels[int(one.second[row])], "second_share": float(one.second_share[row]),
            "margin": float(one.margin[row]),
        }  # fmt: skip

    def _number(self, row: int, which: int) -> tuple[str, float, str]:
        middle = float(np.clip(self.confidence.numbers[row, which], -1.0, 1.0))
        words = f"{middle:+.2f}"
        if isinstance(self.actions, ContinuousActions):
            low, high = self.actions.low[which], self.actions.high[which]
            if np.isfinite([low, high]).all():
                words = number_words(self.number_name(which), float(low + (high - low) * (middle + 1.0) / 2.0))
        return self.number_name(which), 0.5 + 0.5 * middle, words


def number_words(name: str, value: float) -> str:
    """Return a number of a car's actions (rad, left positive; m/s) as racers say it.

    >>> number_words("steering", -0.262), number_words("steering", 0.004), number_words("speed", 1.037)
    ('right 15°', 'straight', '1.04 m/s')
    """
    if name == CAR_NUMBERS[0]:
        degrees = round(float(np.degrees(value)))
        return "straight" if degrees == 0 else f"{'left' if degrees > 0 else 'right'} {abs(degrees)}°"
    return f"{value:.2f} m/s" if name == CAR_NUMBERS[1] else f"{value:+.2f}"


def look_at(
    policy: Any,
    seen: Recording,
    actions: Any,
    question: ExplainTarget = TAKEN,
    steps: int = STEPS,
) -> SaliencySeries:
    """Explain all that a policy was fed.

    Args:
        policy: Who looks.
        seen: What it was fed.
        actions: The spec of what it decides.
        question: Which part of the action.
        steps: Of the integrated gradients.

    Raises:
        AttentionError: It sees no picture, or has no such part.
    """
    if not seen.pictures:
        raise AttentionError(
            "this policy sees {fed}, no picture; expected a camera. `analysis.attention.attribute` tells "
            "how much every number counts.",
            fed=", ".join(seen.inputs),
        )
    name = seen.pictures[0]
    attribution = attribute(policy, seen, question, steps)
    frames = grey(seen.inputs[name].cpu().numpy())
    beside = {
        one: np.abs(part).reshape(len(part), -1) for one, part in attribution.parts.items() if one not in seen.pictures
    }
    return SaliencySeries(
        name, frames, attribution.heat(name), attribution.maps.get(name), attribution.confidence, actions, beside
    )


def grey(fed: Array) -> Array:
    """Return pictures as they were fed, (T, H, W) or (T, H, W, C) of 0 to 1 or 0 to 255, as uint8 (T, H, W).

    Of several channels the last stands for all: of a stack it is the newest.
    """
    plain = fed[..., -1] if fed.ndim == 4 else fed
    scale = 255.0 if plain.max(initial=0.0) <= 1.0 else 1.0
    return np.clip(np.rint(scale * plain), 0, 255).astype(np.uint8)


def shining(heat: Array) -> Array:
    """Return heat (T, H, W) from 0 to 1, one scale for all pictures."""
    top = float(np.percentile(heat, SHARPEST)) if heat.size else 0.0
    return np.clip(heat / (top or float(heat.max(initial=0.0)) or 1.0), 0.0, 1.0)


def glowing(frame: Array, heat: Array, size: tuple[int, int]) -> Array:
    """Return a picture (H, W) with its heat (H, W), 0 to 1, laid over it, uint8 (height, width, 3).

    Args:
        frame: uint8 grey.
        heat: From `shining`.
        size: (width, height), pixels of the result; pixels of the frame stay squares, heat is smooth.
    """
    from matplotlib import colormaps
    from PIL import Image

    below = np.asarray(Image.fromarray(frame).resize(size, Image.Resampling.NEAREST), np.float32)
    smooth = Image.fromarray(heat.astype(np.float32)).resize(size, Image.Resampling.BILINEAR)
    above = np.clip(np.asarray(smooth, np.float32), 0.0, 1.0)
    cover = (0.85 * above**0.6)[..., None]
    colour = 255.0 * colormaps[HEAT](0.25 + 0.75 * above)[..., :3]
    return (0.75 * below[..., None] * (1.0 - cover) + colour * cover).astype(np.uint8)
