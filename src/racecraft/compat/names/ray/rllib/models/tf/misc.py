"""`ray.rllib.models.tf.misc`: what TensorFlow's networks import; they are refused by name before one is made."""

from racecraft.compat.names.ray.rllib.models.torch.misc import normc_initializer


def get_activation_fn(name: str | None = None, framework: str = "tf") -> str | None:
    """Return the name itself."""
    return name


__all__ = ["get_activation_fn", "normc_initializer"]
