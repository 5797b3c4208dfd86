"""One table of settings feeds the command line, the Python API and the docs.

table.py      a setting: name, type, default, unit, range, one sentence; reading and checking a value
groups.py     the groups themselves, one frozen dataclass each
overrides.py  "group.name=value" from the command line or a file, refused with the nearest known name
describe.py   the table as text for --help-settings and docs/settings.md
"""
