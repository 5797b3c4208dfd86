"""The command line; one command per verb a person would say."""

from __future__ import annotations


def main() -> None:
    """Run the command line."""
