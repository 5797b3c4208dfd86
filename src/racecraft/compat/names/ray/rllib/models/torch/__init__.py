"""`ray.rllib.models.torch`."""
