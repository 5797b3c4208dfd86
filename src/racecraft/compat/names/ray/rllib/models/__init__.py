"""`ray.rllib.models`: networks by registration."""

from racecraft.compat.names.ray.rllib.models.catalog import MODEL_DEFAULTS, ModelCatalog
from racecraft.compat.names.ray.rllib.models.model import Model
from racecraft.compat.names.ray.rllib.models.modelv2 import ModelV2

__all__ = ["MODEL_DEFAULTS", "Model", "ModelCatalog", "ModelV2"]
