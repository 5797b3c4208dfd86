"""The files that AWS's tools read of a training: traces, metrics, log, parameters. Begin in `files.py`."""
