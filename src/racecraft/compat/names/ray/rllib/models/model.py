"""`ray.rllib.models.model`: the base of networks before Ray 0.8, which all ran on TensorFlow."""


class Model:
    """A network of TensorFlow's; it is refused by name where a script asks for it."""


__all__ = ["Model"]
