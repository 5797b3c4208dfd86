"""Battlesnake: snakes on a board, and everything that is about them."""
