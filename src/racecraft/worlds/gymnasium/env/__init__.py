"""A Gymnasium environment as a world."""
