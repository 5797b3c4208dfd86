"""The learner's memory, where it is finite: once it is full, the rest of an iteration's episodes is forgotten.

The original's trainer counted the steps of an iteration's episodes as it fetched them, in the order of their numbers,
and learned from none that reached beyond its limit (facts: simapp `deepracer_memory.py`). It was the long and
successful episodes that cost the others their place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import Array


def within_memory(batch: RolloutBatch, quota: int, steps: int) -> RolloutBatch:
    """Return the batch with only those whole episodes active that fit into memory.

    Args:
        batch: From `Collector.collect_episodes(quota)`.
        quota: Whole episodes of each row; ticks after them are not active and count for nothing.
        steps: How many ticks are remembered, prepare ticks included.

    Episode j of row i has number j * R + i, as if each row were a rollout worker. The first episode that would not fit
    closes the memory for every later one, even for one that would still find room.

    >>> import numpy as np
    >>> ended = np.array([[0, 1], [1, 0], [0, 1], [1, 0]], bool)  # lengths: episodes 0 and 2: 2, 2; 1 and 3: 1, 2
    >>> nothing = np.zeros((4, 2), np.float32)
    >>> kept = RolloutBatch({}, nothing, nothing, ended, ~ended & ended, np.ones((4, 2), bool), {}, np.ones(2, bool))
    >>> within_memory(kept, 2, 5).active.T.astype(int)
    array([[1, 1, 1, 1],
           [1, 0, 0, 0]])
    """
    ended = batch.terminated | batch.truncated
    rows = ended.shape[1]
    episode: Array = np.cumsum(ended, axis=0) - ended  # which of its row's episodes each tick belongs to
    number = episode * rows + np.arange(rows)
    lengths = np.bincount(number[episode < quota], minlength=quota * rows)
    fits = np.cumsum(lengths) <= steps
    remembered = (episode < quota) & fits[np.minimum(number, len(fits) - 1)]
    return replace(batch, active=batch.active & remembered)
