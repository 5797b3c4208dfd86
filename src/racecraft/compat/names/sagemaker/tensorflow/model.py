"""`sagemaker.tensorflow.model`."""

from racecraft.sagemaker.model import Model


class TensorFlowModel(Model):
    """What a job left in its model; no TensorFlow is needed."""


__all__ = ["TensorFlowModel"]
