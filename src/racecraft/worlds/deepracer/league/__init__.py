"""Cars in a league: rules, the check at entry, drives and their files. Begin with `races.py`."""
