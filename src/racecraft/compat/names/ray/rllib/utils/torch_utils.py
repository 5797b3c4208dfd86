"""`ray.rllib.utils.torch_utils`: the ends of a float, for masks in a network."""

FLOAT_MIN, FLOAT_MAX = -3.4e38, 3.4e38

__all__ = ["FLOAT_MAX", "FLOAT_MIN"]
