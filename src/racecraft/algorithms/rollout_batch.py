"""What was kept of a rollout, as a learner reads it."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.world import Array


@dataclass
class Experience:
    """T ticks of R rows (worlds times agents). Every array begins with (T, R) unless it says otherwise."""

    observations: dict[str, Array]
    """What was seen before acting, by name, in the world's own types."""
    samples: Array
    """What the policy drew: int64 (T, R), or float32 (T, R, A) in [-1, 1] units."""
    log_prob: Array
    """float32: log-probability of the samples when they were drawn."""
    value: Array
    """float32: the critic's value of what was seen."""
    reward: Array
    """float32: of the tick that the action began."""
    terminated: Array
    """bool: the story ended in that tick."""
    truncated: Array
    """bool: we stopped watching in that tick."""
    active: Array
    """bool: the row is to be learned from."""
    final_value: Array
    """float32: value of the final observation; meaningful where truncated."""
    last_value: Array
    """float32 (R,): value of the observation after the last tick."""
    action_mask: Array | None = None
    """bool (T, R, A), True where an action was allowed; None where the world has no mask."""

    @property
    def num_active(self) -> int:
        """How many transitions there are to learn from."""
        return int(self.active.sum())
