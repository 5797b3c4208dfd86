"""`ray.rllib.policy`."""
