"""The command line: one command per verb a person would say; begin in `app.py`."""
