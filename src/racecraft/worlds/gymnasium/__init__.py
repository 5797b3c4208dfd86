"""Gymnasium's environments as worlds. Begin with `kind.py`, then `env/from_gymnasium.py`.

How any world is seen *as* a Gymnasium environment is `racecraft.adapters`.
"""
