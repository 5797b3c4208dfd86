"""The command line: one command per verb a person would say.

Every command imports what it needs when it runs, so that `--help` answers at once. With `--json` exactly one JSON
object on one line goes to standard output, and everything else to standard error. What the user gave and cannot be used
ends with a letter and exit code 2.
"""

from __future__ import annotations

from racecraft.cli.commands import commands
from racecraft.cli.entry import print_errors
from racecraft.cli.table import app_with

app = app_with(commands())
"""All of it; `entry.main` makes do with the command that is named."""


def main() -> None:
    """Run the command line; errors of ours become letters and exit codes."""
    print_errors(app)
