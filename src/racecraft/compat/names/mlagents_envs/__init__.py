"""`mlagents_envs`: the names that scripts written against ML-Agents' Python package use, over our own wire."""

__version__ = "0.28.0"
