"""Laps as traces along the lap, corners, sectors, and where time is lost. Begin with `laps.py`, then `losses.py`.

A log's ticks become `Laps`; `timing.py` times their sectors and corners; `reference.py` makes a lap to compare with;
`losses.py` says which corner to work on.
"""
