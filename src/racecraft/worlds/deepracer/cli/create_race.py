"""`racecraft league create`: a race of cars."""

from __future__ import annotations

from racecraft.cli.league import organisers_command, show_changed
from racecraft.worlds.deepracer.actions import create_race

create = organisers_command("make race", create_race.create_race, show_changed)
