"""`racecraft snakes`: a file a verb; begin in `snakes.py`."""
