"""`racecraft league create`: a race of cars."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.league import show_changed
from racecraft.worlds.deepracer.actions import create_race

create = command(create_race.create_race, show_changed)
