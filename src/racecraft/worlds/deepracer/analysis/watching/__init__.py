"""Drives of a run to be looked at while it trains and after: plain values for a page, from the run folder alone."""
