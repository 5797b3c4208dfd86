"""Packages that are lent under their foreign names; see `racecraft.compat.shims`."""
