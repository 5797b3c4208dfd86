"""`ray.rllib.models.tf.tf_modelv2`: the base of TensorFlow's networks."""

from racecraft.compat.names.ray.rllib.models.modelv2 import ModelV2


class TFModelV2(ModelV2):
    """A network of TensorFlow's; it is refused by name where a script asks for it."""


__all__ = ["TFModelV2"]
