"""`sagemaker.tensorflow.serving`, the older name."""

from racecraft.compat.names.sagemaker.tensorflow.model import TensorFlowModel

Model = TensorFlowModel

__all__ = ["Model"]
