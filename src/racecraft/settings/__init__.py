"""The mechanism of settings: one table of them feeds the command line, the Python API and the docs.

table.py        a setting: name, type, default, unit, range, one sentence; reading and checking a value
composition.py  the groups of one training, put together
overrides.py    "group.name=value" from the command line or a file, refused with the nearest known name
describe.py     the table as text for `racecraft settings` and docs/reference/settings.md

The groups themselves live with what they set: a world's in its package, an algorithm's in its module.
"""
