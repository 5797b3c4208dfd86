"""Logs of any training, as one table: ours, the console's, DeepRacer for Cloud's, DeepRacer on AWS's.

    import racecraft as rc

    logs = rc.logs.read("my-model")                  # folder, .tar.gz, log, trace, metrics; several are rounds
    logs.ticks                                       # lazy Polars table, one row a tick
    logs.damaged                                     # what could not be taken: file, line, what
    logs.to_pandas()

    read.py        the door
    sources.py     which files are logs, and what each tells
    archive.py     downloads, read without unpacking
    asked.py       the table, read when it is asked for: the columns of a question, or all
    ticks.py       from files to one table: trace_rows, log_rows, our own episodes
    rows_of_text.py  rows out of text: compiled_rows over stretches, the rest line by line
    careful.py     damaged rows, line by line
    numbering.py   episodes told apart over files, workers and rounds
    clocks.py      time that runs back or leaps
    metric_rows.py AWS's metrics files
    columns.py     the columns, in one table

This room stands beside `analysis`: it knows files and nothing of pictures.
"""

from racecraft.worlds.deepracer.logs.columns import METRIC_COLUMNS, TICK_COLUMNS
from racecraft.worlds.deepracer.logs.errors import Damage, LogError
from racecraft.worlds.deepracer.logs.read import read
from racecraft.worlds.deepracer.logs.table import Logs

__all__ = ["METRIC_COLUMNS", "TICK_COLUMNS", "Damage", "LogError", "Logs", "read"]
