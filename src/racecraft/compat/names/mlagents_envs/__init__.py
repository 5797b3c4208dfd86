"""`mlagents_envs`: the names that scripts written against ML-Agents' Python package use, over our own wire."""

__version__ = "1.1.0"
