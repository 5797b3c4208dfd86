"""Between torch and the files: tensors become arrays on the way out and tensors again on the way in.

A learner's state has its weights as the group NETWORK; where a mean of them is judged and kept, that is the group MEAN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

NETWORK, MEAN = "network", "mean"


def to_arrays(value: Any) -> Any:
    """Return nested dictionaries of tensors as nested dictionaries of arrays.

    On the CPU an array is its tensor's own memory; give copies where the tensors go on changing.
    """
    if isinstance(value, torch.Tensor):
        return value.detach().cpu().numpy()
    return {name: to_arrays(part) for name, part in value.items()} if isinstance(value, dict) else value


def to_tensors(value: Any) -> Any:
    """Return nested dictionaries of arrays as nested dictionaries of tensors (copies)."""
    if isinstance(value, np.ndarray | np.generic):
        return torch.from_numpy(np.array(value))
    return {name: to_tensors(part) for name, part in value.items()} if isinstance(value, dict) else value


def take_policy(state: dict[str, Any]) -> Any:
    """Take the weights that a policy is rebuilt from out of a learner's state; see `with_policy`."""
    return state.pop(MEAN if MEAN in state else NETWORK)


def with_policy(state: dict[str, Any], weights: Any) -> dict[str, Any]:
    """Return a learner's state as it was before `take_policy` took these weights out.

    >>> state = {"network": 1, "mean": 2, "averaging": 3}
    >>> with_policy(state, take_policy(state))
    {'network': 1, 'averaging': 3, 'mean': 2}
    """
    return {**state, MEAN if NETWORK in state else NETWORK: weights}
