"""Between torch and the files: tensors become arrays on the way out and tensors again on the way in."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch


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
