"""`racecraft league create-snakes`: a race of snakes."""

from __future__ import annotations

from racecraft.cli.league import organisers_command, show_changed
from racecraft.worlds.battlesnake.actions.create_race import create_snake_race

create = organisers_command("make race", create_snake_race, show_changed)
