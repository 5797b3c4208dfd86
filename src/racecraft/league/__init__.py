"""Ladders of players: which of them meet next. Begin with `pairing.py`."""
