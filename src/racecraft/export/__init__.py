"""A checkpoint that drives elsewhere: what other programs load, written and checked here."""
