"""A game among built-in players as a world of one learner: N games, seat 0 is the learner's, the others are players'.

When the learner leaves a game its episode is over, and the next game begins at once; how the others would have gone on
is not played. Players that are compiled (`anchors.py`) cost next to nothing; any other, a FILE.py or a RUN too, is
asked game by game.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec, allocate
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings
from racecraft.worlds.battlesnake.players.anchors import ANCHORS, AnchorSeats
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.json_adapter import JsonAdapter
from racecraft.worlds.battlesnake.players.protocol import JsonPlayer, PlayerError, SnakePlayer
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move

THINKING_SECONDS = 0.05
"""What a player that is no anchor may think for a move."""


class OneSeatWorld:
    """N games of one learner against named players.

    Args:
        settings: What is played, how many games, what is paid and seen; the number of snakes is set here.
        opponents: Who sits at the other seats, in their order: names that `find_player` knows. None: a solo game.
        seed: Chance of opponents that are no anchors but roll dice.

    Raises:
        PlayerError: There is no such player.
        BoardError: A size, ruleset, map or number that cannot be played.
    """

    def __init__(self, settings: WorldSettings, opponents: Sequence[str], seed: int = 0) -> None:
        game = replace(settings.game, players=1 + len(opponents))
        if not opponents and game.solo is None:
            game = replace(game, solo=True)
        self.inner = BattlesnakeWorld(replace(settings, game=game))
        num_games, seats = self.inner.spec.num_worlds, self.inner.spec.num_agents
        self._asked = {
            seat: _player(name, seed + seat) for seat, name in enumerate(opponents, 1) if name not in ANCHORS
        }
        anchors = ["", *("" if seat in self._asked else name for seat, name in enumerate(opponents, 1))]
        self._anchors = AnchorSeats([anchors] * num_games, self.inner)
        self.inner.looks[:, 1:] = False
        self._spec = replace(self.inner.spec, num_agents=1)
        self._buffers, self._moves = allocate(self.inner.spec), np.zeros((num_games, seats), np.int64)

    @property
    def spec(self) -> WorldSpec:
        """N worlds of one agent."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides the anchors' dice, too."""
        self._anchors.begin(seed)
        self.inner.reset(self._buffers, seed)
        self._show(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game: the learner's moves as given, everybody else's as they choose."""
        inner = self._buffers
        self._moves[:, 0] = actions[:, 0]
        self._anchors.choose(self._moves)
        self._ask_players()
        self.inner.step(self._moves, inner)
        for name in ("reward", "terminated", "truncated"):
            getattr(buffers, name)[:, 0] = getattr(inner, name)[:, 0]
        ended = inner.ended[:, 0]
        left_behind = ended & ~inner.active[:, 0]  # the others play on: nobody will watch them
        for name, array in buffers.final_observations.items():
            last = np.where(
                left_behind.reshape(-1, *[1] * (array.ndim - 2)),
                inner.observations[name][:, 0], inner.final_observations[name][:, 0],
            )  # fmt: skip
            array[ended, 0] = last[ended]
        if left_behind.any():
            self.inner.begin_games(left_behind, inner)
        self._show(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the learner's finished episodes."""
        return [one for one in self.inner.pop_episodes() if one.agent == 0]

    def board(self, game: int) -> Board:
        """Return a game's position; the learner is s0."""
        return self.inner.board(game)

    def save_state(self) -> dict[str, Array]:
        """Return copies of the games and of the anchors' dice; a player that is no anchor may keep more to itself."""
        return {**{f"game.{name}": array for name, array in self.inner.save_state().items()},
                "anchors": self._anchors.chance.copy()}  # fmt: skip

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        games = {name.removeprefix("game."): array for name, array in state.items() if name.startswith("game.")}
        self.inner.load_state(games, self._buffers)
        self._anchors.chance[...] = state["anchors"]
        self._show(buffers)

    def close(self) -> None:
        """Let go of threads, and of the processes of players' files."""
        self.inner.close()
        for _, owner in self._asked.values():
            if not isinstance(owner, SnakePlayer):
                owner.close()

    def _ask_players(self) -> None:
        """Ask the players that are no anchors, game by game; who fails moves to a safe square."""
        if not self._asked:
            return
        settings = self.inner.game_settings
        for game in range(len(self._moves)):
            board = self.inner.board(game)
            for seat, (player, _) in self._asked.items():
                if board.snakes[seat].alive:
                    self._moves[game, seat] = MOVES.index(_choice(player, board, settings, f"s{seat}"))

    def _show(self, buffers: StepBuffers) -> None:
        inner = self._buffers
        for name, array in inner.observations.items():
            buffers.observations[name][:, 0] = array[:, 0]
        buffers.active[:, 0] = inner.active[:, 0]
        if buffers.action_mask is not None and inner.action_mask is not None:
            buffers.action_mask[:, 0] = inner.action_mask[:, 0]


def seats_for(opponents: str | Sequence[str], snakes: int | None) -> tuple[str, ...]:
    """Return the opponents at all other seats, repeated in turn until a game has so many snakes.

    >>> seats_for("hungry", 3), seats_for(("hungry", "flood_fill"), None)
    (('hungry', 'hungry'), ('hungry', 'flood_fill'))
    """
    named = (opponents,) if isinstance(opponents, str) else tuple(opponents)
    if snakes is None:
        return named
    if snakes < 1 or (snakes > 1 and not named) or len(named) > max(1, snakes - 1):
        raise SettingError(
            "snakes is {snakes} with {count} opponents; expected one snake more than opponents.",
            snakes=snakes,
            count=len(named),
        )
    return tuple(named[number % len(named)] for number in range(snakes - 1))


def _player(name: str, seed: int) -> tuple[SnakePlayer, SnakePlayer | JsonPlayer]:
    """Return a player that is shown boards, and who it is or stands for."""
    found = find_player(name, seed)
    return (found if isinstance(found, SnakePlayer) else JsonAdapter(found)), found


def _choice(player: SnakePlayer, board: Board, settings: GameSettings, snake_id: str) -> str:
    try:
        word = player.choose(board, settings, snake_id, THINKING_SECONDS)
    except (PlayerError, TimeoutError):
        return best_safe_move(board, settings, snake_id)
    return word if word in MOVES else best_safe_move(board, settings, snake_id)
