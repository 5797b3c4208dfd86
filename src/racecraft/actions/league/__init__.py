"""Races between models: make, enter, judge, show, manage. Each function is a command of `racecraft league`."""
