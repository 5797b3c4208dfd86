"""`tensorflow`, for a script's own files where none is installed: many import it and never ask for anything of it.

Whoever does ask is told that it is not here. Packages that look for TensorFlow to use it find none.
"""

from __future__ import annotations

from typing import Any

from racecraft.contract.errors import SettingError


class TensorFlowMissingError(SettingError, AttributeError):
    """Something of TensorFlow's was asked for, and it is not installed."""


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise TensorFlowMissingError(
        f"tensorflow.{name}: TensorFlow is not installed, and networks are PyTorch's here. Leave out what needs it, or "
        "`pip install tensorflow` where the script itself does."
    )
