"""Gymnasium's errors under their old name."""

from gymnasium.error import DependencyNotInstalled, Error, NameNotFound, ResetNeeded, UnregisteredEnv

__all__ = ["DependencyNotInstalled", "Error", "NameNotFound", "ResetNeeded", "UnregisteredEnv"]
