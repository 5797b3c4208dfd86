"""`racecraft league create-snakes`: a race of snakes."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.league import show_changed
from racecraft.worlds.battlesnake.actions.create_race import create_snake_race

create = command(create_snake_race, show_changed)
