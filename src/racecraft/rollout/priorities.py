"""How often each transition is drawn: in proportion to how badly its value was foreseen. Begin with `Priorities`.

Source: Schaul et al., "Prioritized experience replay", 2016, the proportional variant.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array
from racecraft.rollout.kernels.sum_tree import FAN, draw_leaves, set_leaves

SMALLEST_ERROR = 1e-6
"""Added to every error, so that what was foreseen exactly is drawn now and then (epsilon)."""


class Priorities:
    """Weights of `count` places, 0 at first: a place of weight 0 is never drawn.

    Args:
        count: Places.
        exponent: A weight is (|error| + epsilon) to this power (alpha).
    """

    def __init__(self, count: int, exponent: float) -> None:
        self.count, self._exponent = count, exponent
        sizes = [padded(count)]
        while sizes[-1] > FAN:
            sizes.append(padded(sizes[-1] // FAN))
        sizes.append(1)
        self._offsets = np.concatenate([[0], np.cumsum(sizes[:-1])]).astype(np.int64)
        self._tree, self._running = np.zeros(sum(sizes)), np.zeros(sum(sizes))
        self.largest = 1.0
        """The largest weight seen: what is new gets it, so that everything is drawn soon."""

    def weights_of(self, errors: Array) -> Array:
        """Return the weights of such errors, float64 (B,)."""
        found: Array = (np.abs(np.asarray(errors, np.float64)) + SMALLEST_ERROR) ** self._exponent
        return found

    def set(self, index: Array, weights: Array | float) -> None:
        """Give places (int64 (B,)) their weights, 0 or more."""
        values = np.ascontiguousarray(np.broadcast_to(weights, index.shape), np.float64)
        if len(index):
            self.largest = max(self.largest, float(values.max()))
            set_leaves(self._tree, self._running, self._offsets, np.ascontiguousarray(index), values)

    def set_errors(self, index: Array, errors: Array) -> None:
        """Set the weights of places that were drawn; one that has been given up since (weight 0) stays so."""
        still = self._tree[index] > 0.0
        self.set(index[still], self.weights_of(errors[still]))

    def draw(self, uniform: Array) -> tuple[Array, Array]:
        """Draw a place from each of B equal slices of all weight.

        Args:
            uniform: float64 (B,), in [0, 1): the chance.

        Returns:
            The places, int64 (B,), and the probability of each in one draw from all, float64 (B,).
        """
        index, share = np.empty(len(uniform), np.int64), np.empty(len(uniform))
        draw_leaves(self._tree, self._running, self._offsets, uniform, index, share)
        return index, share

    @property
    def leaves(self) -> Array:
        """The weights, float64 (count,); a view."""
        return self._tree[: self.count]


def padded(count: int) -> int:
    """Return the next multiple of a node's children.

    >>> padded(1), padded(16), padded(17)
    (16, 16, 32)
    """
    return -(-count // FAN) * FAN
