"""`ray.rllib.models.tf.fcnet`."""

from racecraft.compat.names.ray.rllib.models.tf.tf_modelv2 import TFModelV2


class FullyConnectedNetwork(TFModelV2):
    """Dense layers of TensorFlow's."""


__all__ = ["FullyConnectedNetwork"]
