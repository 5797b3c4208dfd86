"""`ray.rllib.models.tf`: names, so that a script is read to where it asks for its model."""
