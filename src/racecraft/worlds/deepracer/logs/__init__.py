"""Logs of any training, as one table: ours, the console's, DeepRacer for Cloud's, DeepRacer on AWS's.

    import racecraft as rc

    logs = rc.logs.read("my-model")                  # folder, .tar.gz, log, trace, metrics; several are rounds
    logs.ticks                                       # lazy Polars table, one row a tick
    logs.damaged                                     # what could not be taken: file, line, what
    logs.to_pandas()

    read.py        the door
    sources.py     which files are logs, and what each tells
    archive.py     downloads, read without unpacking
    lazy_ticks.py  the table, read at the first query
    ticks.py       from files to one table: trace_rows, log_rows, our own episodes
    csv_rows.py    rows out of text, parsed by Polars
    tolerant_rows.py  damaged rows, one by one
    numbering.py   episodes told apart over files, workers and rounds
    clocks.py      time that runs back or leaps
    metric_rows.py metrics files: AWS's, and by coach_csv.py Coach's
    columns.py     the columns, in one table

This package stands beside `analysis`: it knows files and nothing of pictures.
"""

from racecraft.worlds.deepracer.logs.columns import METRIC_COLUMNS, TICK_COLUMNS
from racecraft.worlds.deepracer.logs.errors import Damage, LogError
from racecraft.worlds.deepracer.logs.read import read
from racecraft.worlds.deepracer.logs.table import Logs

__all__ = ["METRIC_COLUMNS", "TICK_COLUMNS", "Damage", "LogError", "Logs", "read"]
