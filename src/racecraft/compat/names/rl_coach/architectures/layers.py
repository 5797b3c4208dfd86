"""Layers."""

from racecraft.compat.coach_words import Layer as Dense

__all__ = ["Dense"]
