"""`ray.rllib.algorithms`, as Ray 2 calls what were agents."""
