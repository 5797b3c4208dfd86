"""A world for racecraft in a package of its own. Begin with `kind.py`, then `world.py`."""
