"""Compiled bodies of the reader of logs.

decimals.py   digits to floats, correctly rounded or not at all
fields.py     the numbers that fill fields whose ends are known, a column of them at once
rows.py       comma-separated rows to columns; the rows of a log among its other lines
"""
