"""`ray.rllib.utils.framework`: networks are PyTorch's here."""

from __future__ import annotations

from typing import Any


def try_import_torch(error: bool = False) -> tuple[Any, Any]:
    """Return torch and torch.nn."""
    import torch
    from torch import nn

    return torch, nn


def try_import_tf(error: bool = False) -> tuple[None, None, None]:
    """Return that there is no TensorFlow: networks of it are refused by name."""
    return None, None, None


__all__ = ["try_import_tf", "try_import_torch"]
