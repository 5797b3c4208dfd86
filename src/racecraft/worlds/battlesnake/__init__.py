"""Battlesnake: rules, players from rules to search, arenas, servers. Begin with `kind.py`, then `env/reference.py`.

env (the readable referee and the same rules compiled) → players → evaluation → analysis → training → serving → cli;
`league/` holds the arena and the tuning of search weights.
"""
