"""A trained policy by itself: `load_policy` of a run, or of a model that a world opens. Begin with `trained.py`."""
