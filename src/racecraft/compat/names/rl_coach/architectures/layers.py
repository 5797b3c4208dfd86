"""Layers."""

from racecraft.compat.coach_config import Layer as Dense

__all__ = ["Dense"]
