"""Snakes in a league. Begin with `SnakeLeague`, which the world's kind names.

What plays is imported when something plays: pages ask for boards alone.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.league.race import Race
from racecraft.league.world_part import Driven, DriveOrder, OnProgress, no_progress


class SnakeLeague:
    """A race of snakes, as `racecraft.league.world_part.LeagueWorld` asks for it; its tracks are maps."""

    def admit(self, source: str, folder: Path, rules: Mapping[str, Any]) -> dict[str, Any]:
        """Copy a player, let it sit down once, and return its facts; see `race_entry.admit_snake`."""
        from racecraft.worlds.battlesnake.league.race_entry import admit_snake
        from racecraft.worlds.battlesnake.league.race_rules import SnakeRules

        return admit_snake(source, folder, SnakeRules.from_dictionary(rules))

    def name_of(self, source: str) -> str:
        """Return what a board calls a player."""
        return source if "://" in source else Path(source).stem

    def describe(self, rules: Mapping[str, Any], tracks: Sequence[str]) -> list[str]:
        """Return the rules, a line each."""
        from racecraft.worlds.battlesnake.league.race_rules import SnakeRules

        return SnakeRules.from_dictionary(rules).describe()

    def history(self, race: Race, laps: Sequence[float | None], archive: Path) -> list[dict[str, Any]]:
        """Return nothing: there are no older boards of snakes."""
        return []

    def canonical_track(self, name: str) -> str:
        """Return a map's name, or refuse it."""
        from racecraft.worlds.battlesnake.env.maps import find_map

        find_map(name)
        return name

    def is_alone(self, order: DriveOrder) -> bool:
        """Servers are asked over the network, and a FILE.py is in a process of its own, which is limited itself."""
        from racecraft.worlds.battlesnake.league.race_entry import needs_others

        return not any(needs_others(Path(model)) for model in order.models)

    def warm_up(self) -> None:
        """Let search choose a move: everything is imported and compiled then."""
        from racecraft.worlds.battlesnake.league import race_entry, race_games  # noqa: F401
        from racecraft.worlds.battlesnake.players.find import find_player, warm_up

        warm_up(find_player("search"))

    def drive(self, order: DriveOrder, on_progress: OnProgress = no_progress) -> Driven:
        """Let the snakes play."""
        from racecraft.worlds.battlesnake.league.race_entry import seat_of
        from racecraft.worlds.battlesnake.league.race_games import files_of, outcomes_of, play_heat
        from racecraft.worlds.battlesnake.league.race_rules import SnakeRules

        rules = SnakeRules.from_dictionary(order.rules)
        with contextlib.ExitStack() as stack:
            seats = []
            for index, (model, name) in enumerate(zip(order.models, order.names, strict=True)):
                seats.append(seat_of(Path(model), name, order.seed + index, rules))
                stack.callback(seats[-1].leave)
            games = play_heat(seats, rules.game(order.track, len(seats)), rules, order.seed, on_progress)
        return Driven(outcomes_of(games), files_of(games))

    def film(self, order: DriveOrder, folder: Path, video: Path, seen_from: int) -> None:
        """Film the game of a heat in which a player sat on the first seat."""
        from racecraft.worlds.battlesnake.analysis.board_film import film_game
        from racecraft.worlds.battlesnake.league.race_games import replay_heat
        from racecraft.worlds.battlesnake.league.race_rules import SnakeRules

        rules = SnakeRules.from_dictionary(order.rules)
        games = replay_heat(folder, rules.game(order.track, len(order.models)), rules, order.seed)
        game = next(one for one in games if one.seated[0] == seen_from)
        names = {f"s{seat}": order.names[player] for seat, player in enumerate(game.seated)}
        film_game(game.played.boards, replace(game.played.card, names=names), video)

    def road(self, track: str) -> None:
        """Return nothing: a game has no road that is seen from above."""

    def shown(self, folder: Path) -> dict[str, Any]:
        """Refuse: a game has no road that is seen from above.

        Raises:
            SettingError: Always; it names what shows the game.
        """
        raise SettingError(
            "{folder} holds games of snakes; expected a drive on a road. `racecraft league film` shows them, and so "
            "does `racecraft snakes watch` with its game-1.jsonl.",
            folder=folder.name,
        )

    def redrive(self, order: DriveOrder, folder: Path) -> Driven:
        """Play again by recorded moves."""
        from racecraft.worlds.battlesnake.league.race_games import outcomes_of, replay_heat
        from racecraft.worlds.battlesnake.league.race_rules import SnakeRules

        rules = SnakeRules.from_dictionary(order.rules)
        games = replay_heat(folder, rules.game(order.track, len(order.models)), rules, order.seed)
        return Driven(outcomes_of(games), {})
