"""`ray.rllib.agents`."""
