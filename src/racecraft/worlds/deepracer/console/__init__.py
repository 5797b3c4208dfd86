"""What cars add to the console: cards, pictures of tracks, the form in which a car is made. Begin with `parts.py`."""
