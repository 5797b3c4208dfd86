"""Ladders of players: who meets next, whatever they play. Begin with `pairing.py`.

Ratings are those of `evaluation/rating.py`; the ladder of snakes is in `worlds/battlesnake/league/`.
"""
