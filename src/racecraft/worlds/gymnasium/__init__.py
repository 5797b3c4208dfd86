"""Gymnasium's environments as worlds, and everything that is about them."""
