"""`ray.rllib.utils`."""

from racecraft.compat.names.ray.rllib.utils.framework import try_import_tf, try_import_torch

__all__ = ["try_import_tf", "try_import_torch"]
