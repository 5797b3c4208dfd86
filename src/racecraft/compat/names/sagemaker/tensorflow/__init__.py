"""`sagemaker.tensorflow`: the notebooks' way to an endpoint for what Ray's script trained."""

from racecraft.compat.names.sagemaker.tensorflow.model import TensorFlowModel

__all__ = ["TensorFlowModel"]
