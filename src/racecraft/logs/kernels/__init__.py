"""Compiled bodies of the reader of logs.

decimals.py   digits to floats, correctly rounded or not at all
rows.py       comma-separated rows to columns; the rows of a log among its other lines
"""
