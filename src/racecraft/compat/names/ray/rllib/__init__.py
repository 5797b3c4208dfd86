"""`ray.rllib`, as far as launcher scripts import it: environments of several agents, models by registration, names."""
