"""Snakes as picture, film and page."""
