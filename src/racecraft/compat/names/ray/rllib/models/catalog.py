"""`ray.rllib.models.catalog`."""

from __future__ import annotations

from typing import Any

from racecraft.compat.script_models import DEFAULTS, register_model

MODEL_DEFAULTS: dict[str, Any] = dict(DEFAULTS)


class ModelCatalog:
    """Networks by name."""

    @staticmethod
    def register_custom_model(model_name: str, model_class: type) -> None:
        """Keep a network under a name, for config.model.custom_model."""
        register_model(model_name, model_class)


__all__ = ["MODEL_DEFAULTS", "ModelCatalog"]
