"""`racecraft league`, with `create` for races of cars."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.cli.league import league_app, show_changed
from racecraft.worlds.deepracer.actions.create_race import create_race

app = league_app(command(create_race, show_changed))
