"""First weights of what a foreign model's file does not hold: each critic has its own, the same at every import."""

import numpy as np

from racecraft.algorithms.weight_init import fresh_critics

ACTOR = {
    "eyes.0.weight": np.ones((16, 1, 6, 6), np.float32), "eyes.0.bias": np.ones(16, np.float32),
    "actor.0.weight": np.ones((64, 30), np.float32),
}  # fmt: skip


def test_two_critics_begin_unlike_each_other_and_the_same_at_every_import():
    critics, again = (fresh_critics(ACTOR, 32, (40, 24)) for _ in range(2))
    assert not np.array_equal(*critics["critics.weights.0"])
    assert all(np.array_equal(part, again[name]) for name, part in critics.items())
