"""N games of M snakes under the `World` contract. Begin in `BattlesnakeWorld.step`.

An agent's episode ends with its death (`terminated`), with the game (`terminated`, the winner too) or with `max_turns`
(`truncated`). A dead snake is inactive and sees nothing until the game is over; then all begin the next one together.

The same seed and actions tell the same story bit for bit: each game rolls its own stream, on any number of threads.
Common set-ups are compiled; maps with drawn plans, unusual boards and solo_maze go through the referee's set-up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, DiscreteActions, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.kernels import threads
from racecraft.worlds.battlesnake.env import maps, solo_maze
from racecraft.worlds.battlesnake.env.board import CAUSES, MOVES, Board, BoardError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.env.kernels.outlook import outlook_games
from racecraft.worlds.battlesnake.env.kernels.steps import begin_games, observe_games, step_games
from racecraft.worlds.battlesnake.env.observation import (
    allocate_marks,
    allocate_scratch,
    allocate_sheets,
    default_view,
    observation_specs,
    squares_of,
    wall_planes,
)
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import allocate_games, food_squares_of, get_board, params_of, put_board

_GAMES_WORTH_A_THREAD = 256
"""Handing a thread its share costs 0.1 ms: two threads gain a fifth with 512 games and all of a core with 2,048."""

_NO_SCRATCH, _NO_OUTLOOK = np.zeros((0, 5, 0), np.int32), np.zeros((0, 0, 4, 0), np.float32)


@dataclass(frozen=True)
class RewardWeights:
    """What a snake is paid."""

    turn: float = 0.0
    """For a turn survived while the game goes on."""
    food: float = 0.0
    """For a food eaten."""
    kill: float = 0.0
    """For another snake that ran into it."""
    win: float = 1.0
    """For being alive when a game among several is over."""
    loss: float = -1.0
    """For leaving the game."""

    def as_array(self) -> Array:
        """Return the prizes as the kernel reads them, float32 (5,)."""
        return np.array([self.turn, self.food, self.kill, self.win, self.loss], np.float32)


@dataclass(frozen=True)
class WorldSettings:
    """Settings of a Battlesnake world."""

    game: GameSettings = field(default_factory=GameSettings)
    """What every game is played with."""
    num_games: int = 64
    """Games side by side."""
    max_turns: int = 2000
    """Turns after which a game is cut; 0 never."""
    view: int | None = None
    """Side of the window in squares, odd; None: see `observation.default_view`."""
    outlook: bool = False
    """Whether a snake is told what lies behind each of its moves, too; see `observation.py`."""
    prizes: RewardWeights = field(default_factory=RewardWeights)


class BattlesnakeWorld:
    """N games of M snakes; actions are 0 up, 1 down, 2 left, 3 right.

    Args:
        settings: What is played, how many games, what is paid.

    Raises:
        BoardError: A size, ruleset, map or number that cannot be played.
    """

    def __init__(self, settings: WorldSettings | None = None) -> None:
        self.settings = settings or WorldSettings()
        self.game_settings = game = self.settings.game
        if self.settings.num_games < 1 or self.settings.max_turns < 0:
            numbers = f"num_games {self.settings.num_games}, max_turns {self.settings.max_turns}"
            raise BoardError("{numbers}; expected at least 1 and 0.", numbers=numbers)
        self._map = maps.find_map(game.map)
        self._map.check(game)
        self.params, self.food_squares = params_of(game), food_squares_of(game)
        self._prizes = self.settings.prizes.as_array()
        self._compiled_set_up, self.start_hazards = _compiled_set_up(game)
        rows = (self.settings.num_games, game.players)
        self.games = allocate_games(game, rows[0])
        self._tally = np.zeros((*rows, 3))
        self._last = self.games.snakes.copy(), np.zeros((*rows, col.NUM_GAME_COLUMNS), np.int32), self._tally.copy()
        self._over = np.zeros(rows[0], bool)
        self._all, self._squares = np.ones(rows[0], bool), squares_of(game)
        self._marks = allocate_marks(game, *rows)
        self.looks = np.ones(rows, bool)
        """Who is told the outlook, bool (N, M); the others' rows stay zero. It may be changed between two steps."""
        self._scratch = allocate_scratch(game, rows[0]) if self.settings.outlook else None
        self._no_active, self._no_mask = np.zeros(rows, bool), np.zeros((*rows, 4), bool)
        self._finished: list[tuple[Array, ...]] = []
        self._pool: ThreadPoolExecutor | None = None
        view = self.settings.view or default_view(game.width, game.height)
        self._walls = wall_planes(game.width, game.height, view)
        self._sheets = allocate_sheets(game, rows[0], view)
        self._spec = WorldSpec(
            name=f"battlesnake-{game.ruleset}-{game.map}-{game.width}x{game.height}",
            num_worlds=rows[0],
            num_agents=rows[1],
            observations=observation_specs(view, self.settings.outlook),
            actions=DiscreteActions(4, MOVES),
            has_action_mask=True,
        )

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides every set-up, food and hazard from here on."""
        self.games.chance[:, 0] = stream_keys(seed, "battlesnake", self.settings.num_games)
        self.games.chance[:, 1] = 0
        self._finished.clear()
        self._begin(self._all)
        self._observe(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game; games that are over begin anew in the same step."""
        games, behind = self.games, self._scratch is not None
        seen, last = buffers.observations, buffers.final_observations
        mask = self._no_mask if buffers.action_mask is None else buffers.action_mask
        self._share(
            step_games, self._compiled_set_up, behind, np.ascontiguousarray(actions, np.int64), games.bodies,
            games.snakes, games.games, games.cells, games.sides, games.events, games.chance, self.params,
            self.food_squares, self.start_hazards, self._squares, self._marks, self._sheets, self._walls, self.looks,
            self._scratch if behind else _NO_SCRATCH, self._prizes, self.settings.max_turns, buffers.reward,
            buffers.terminated, buffers.truncated, self._over, self._tally, *self._last, seen["planes"],
            seen["numbers"], seen.get("outlook", _NO_OUTLOOK), buffers.active, mask, last["planes"], last["numbers"],
            last.get("outlook", _NO_OUTLOOK), self._no_active, self._no_mask,
        )  # fmt: skip
        if buffers.terminated.any() or buffers.truncated.any():
            self._remember(buffers.ended)
        if self._compiled_set_up:
            return
        if self._map.hazards == "maze":
            self._move_mazes()
        self._begin(self._over)
        self._look(self._all if self._map.hazards == "maze" else self._over, seen, buffers.active, mask)

    def begin_games(self, which: Array, buffers: StepBuffers) -> None:
        """Break off the games marked in `which`, bool (N,), and begin the next ones; their snakes are told of nothing.

        Writes `observations`, `active` and `action_mask` of all games.
        """
        self._begin(which)
        self._observe(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call; status is "won", "truncated" or the cause of death."""
        records = [self._tell(*row) for columns in self._finished for row in zip(*columns, strict=True)]
        self._finished.clear()
        return records

    def board(self, game: int) -> Board:
        """Return a game's position as a board; its snakes are s0, s1 and so on."""
        return get_board(self.games, game, self.game_settings)

    def save_state(self) -> dict[str, Array]:
        """Return copies of everything the games need to go on."""
        return {name: array.copy() for name, array in (*self.games.arrays().items(), ("tally", self._tally))}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        self.games.copy_from(state)
        self._tally[...] = state["tally"]
        self._finished.clear()
        self._observe(buffers)

    def close(self) -> None:
        """Let go of the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _observe(self, buffers: StepBuffers) -> None:
        mask = self._no_mask if buffers.action_mask is None else buffers.action_mask
        self._look(self._all, buffers.observations, buffers.active, mask)

    def _look(self, which: Array, observations: Mapping[str, Array], active: Array, mask: Array) -> None:
        games = self.games
        self._share(
            observe_games, which, games.bodies, games.snakes, games.games, games.cells, self.params, self._squares,
            self._marks, self._sheets, self._walls, observations["planes"], observations["numbers"], active, mask,
        )  # fmt: skip
        if self._scratch is not None:
            self._share(
                outlook_games, which, self.looks, games.bodies, games.snakes, games.cells, self.params, mask,
                self._scratch, observations["outlook"],
            )  # fmt: skip

    def _share(self, loop: Callable[..., Any], *arguments: Any) -> None:
        """Run a loop over games on the threads that kernels may use; few games are not worth sharing."""
        count = min(threads(), self.settings.num_games // _GAMES_WORTH_A_THREAD)
        if count <= 1:
            loop(0, self.settings.num_games, *arguments)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(count - 1, "battlesnake")
        edges = [self.settings.num_games * part // count for part in range(count + 1)]
        own, *others = zip(edges[:-1], edges[1:], strict=True)
        parts = [self._pool.submit(loop, *edge, *arguments) for edge in others]
        loop(*own, *arguments)
        for part in parts:
            part.result()

    def _begin(self, which: Array) -> None:
        """Set up the games marked in `which`."""
        games = self.games
        if self._compiled_set_up:
            self._share(
                begin_games, which, games.bodies, games.snakes, games.games, games.cells, games.sides, games.chance,
                self.params, self.start_hazards, self._tally,
            )  # fmt: skip
            return
        for g in np.flatnonzero(which):
            dice = StreamDice(int(games.chance[g, 0]), int(games.chance[g, 1]))
            referee = Referee(self.game_settings, dice)
            put_board(games, int(g), referee.board, referee.map_state)
            games.chance[g, 1] = dice.counter
        self._tally[which] = 0

    def _move_mazes(self) -> None:
        """Let solo_maze do what the kernels leave to it: build the next level, let food run away."""
        for g in np.flatnonzero(~self._over):
            board = self.board(int(g))
            dice = StreamDice(int(self.games.chance[g, 0]), int(self.games.chance[g, 1]))
            solo_maze.after_turn(board, dice)
            put_board(self.games, int(g), board)
            self.games.chance[g, 1] = dice.counter

    def _remember(self, ended: Array) -> None:
        """Keep the figures of the episodes that ended, as arrays until somebody asks."""
        game, agent = np.nonzero(ended)
        self._finished.append((game, agent, *(array[game, agent] for array in self._last)))

    def _tell(self, game: int, agent: int, snake: Array, row: Array, tally: Array) -> EpisodeRecord:
        over = row[col.ALIVE] <= (0 if self.params[col.SOLO] else 1)
        status = CAUSES[snake[col.CAUSE]] or ("won" if over else "truncated")
        reward, food, kills = (float(number) for number in tally)
        facts = {"length": float(snake[col.LENGTH]), "food_eaten": food, "kills": kills}
        return EpisodeRecord(int(game), int(agent), int(row[col.TURN]), reward, status, facts)


def _compiled_set_up(game: GameSettings) -> tuple[bool, Array]:
    """Tell whether `begin_standard` sets this game up, and which hazards (C,) then stand from the start."""
    chosen = maps.find_map(game.map)
    start = np.zeros(game.area, np.int16)
    common = game.width == game.height and game.width >= 7 and game.players <= 8
    if not common or not chosen.is_fixed or chosen.drawn or chosen.hazards == "maze":
        return False, start
    for (x, y), count in chosen.plan(game, StreamDice(0)).start.items():
        start[y * game.width + x] = count
    return True, start
