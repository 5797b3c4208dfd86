"""Arenas that last: snakes that come and go, every game, ratings."""
