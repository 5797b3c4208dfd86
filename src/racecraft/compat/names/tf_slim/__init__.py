"""`tf_slim`, layers of TensorFlow's, for a script's own files where none is installed: as with `tensorflow` itself."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.tensorflow import TensorFlowMissingError


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise TensorFlowMissingError(
        f"tf_slim.{name}: its networks are TensorFlow's, and networks are PyTorch's here. Leave out what needs it."
    )
