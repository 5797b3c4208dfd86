"""Scalar bodies of the DeepRacer world, compiled once and shared among cars."""
