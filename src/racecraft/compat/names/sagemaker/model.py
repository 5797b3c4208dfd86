"""`sagemaker.model`."""

from racecraft.sagemaker.model import Model

__all__ = ["Model"]
