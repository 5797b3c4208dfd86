"""Policies and players that answer over HTTP."""
