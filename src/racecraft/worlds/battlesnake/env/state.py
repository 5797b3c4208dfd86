"""N games side by side as a structure of arrays, and the way from and to a `Board`.

The arrays are the kernels' own (`kernels/columns.py` names the columns). A game whose living snakes overlap, or whose
bodies leave the board, cannot be told in these arrays and is refused; the referee plays such boards.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env import maps
from racecraft.worlds.battlesnake.env.board import CAUSES, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.env.layouts import layout
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset, is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings

_FOOD_RULES = ("none", "standard", "off hazards", "arcade", "castle")
_HAZARD_RULES = ("plan", "royale", "snail", "maze")


@dataclass
class Games:
    """Positions of N games with M snakes each."""

    bodies: Array
    """int16 (N, M, P): cells of each body, a ring of P places (a power of two) that begins at START."""
    snakes: Array
    """int32 (N, M, 10)."""
    games: Array
    """int32 (N, 4)."""
    cells: Array
    """int16 (N, 4, C): owner, food, hazards, notes of each cell."""
    sides: Array
    """int8 (N, W + H): royale's shrinks."""
    events: Array
    """int32 (N, E, 3): the hazard plan by turn; rows beyond its end have a turn that never comes."""
    chance: Array
    """uint64 (N, 2): key and counter of each game's dice."""

    def arrays(self) -> dict[str, Array]:
        """Return the arrays by name."""
        return dict(vars(self))

    def copy_from(self, arrays: Mapping[str, Array]) -> None:
        """Take over saved arrays, in place."""
        for name, array in vars(self).items():
            array[...] = arrays[name]


def allocate_games(settings: GameSettings, num_games: int, keys: Array | None = None) -> Games:
    """Return arrays for N games; nothing has begun in them. `keys` uint64 (N,) are the dice's stream keys."""
    ring = 1 << (settings.area + 3).bit_length()
    chance = np.zeros((num_games, 2), np.uint64)
    chance[:, 0] = 0 if keys is None else keys
    return Games(
        bodies=np.zeros((num_games, settings.players, ring), np.int16),
        snakes=np.zeros((num_games, settings.players, col.NUM_SNAKE_COLUMNS), np.int32),
        games=np.zeros((num_games, col.NUM_GAME_COLUMNS), np.int32),
        cells=np.zeros((num_games, 4, settings.area), np.int16),
        sides=np.zeros((num_games, settings.width + settings.height), np.int8),
        events=np.full((num_games, _most_events(settings), 3), np.iinfo(np.int32).max, np.int32),
        chance=chance,
    )


def params_of(settings: GameSettings) -> Array:
    """Return the settings as the kernels read them, int32 (16,)."""
    chosen, rules = maps.find_map(settings.map), find_ruleset(settings.ruleset)
    names = {stage.__name__ for stage in rules.stages}
    params = np.zeros(col.NUM_PARAMS, np.int32)
    params[col.WIDTH], params[col.HEIGHT] = settings.width, settings.height
    params[col.WRAPPED] = "move_wrapped" in names
    params[col.ROYALE] = "shrink_safe_zone" in names
    params[col.CONSTRICTOR] = "always_grow" in names
    params[col.SOLO] = not is_over(Board(1, 1, snakes=[Snake("", [(0, 0)])]), settings)
    params[col.DAMAGE], params[col.SHRINK] = settings.hazard_damage, settings.shrink_every
    params[col.FOOD_RULE] = _FOOD_RULES.index(chosen.food)
    params[col.CHANCE], params[col.MIN_FOOD] = settings.food_spawn_chance, settings.minimum_food
    params[col.HAZARD_RULE] = _HAZARD_RULES.index(chosen.hazards)
    params[col.CASTLE_FOOD] = chosen.castle_food
    params[col.START_FOOD] = chosen.start_food == "standard"
    return params


def food_squares_of(settings: GameSettings) -> Array:
    """Return the cells of the map's food list, int16 (F,); empty where food falls anywhere."""
    chosen = maps.find_map(settings.map)
    squares = layout(chosen.id).food if chosen.food in ("arcade", "castle") else ()
    return np.array([y * settings.width + x for x, y in squares], np.int16)


def put_board(games: Games, g: int, board: Board, state: maps.MapState | None = None) -> None:
    """Write a position, and what its map keeps in mind, into game g; the dice are left alone.

    Raises:
        BoardError: The position cannot be told in these arrays.
    """
    for array in (games.bodies, games.snakes, games.games, games.cells):
        array[g] = 0
    games.games[g, [col.TURN, col.FOOD, col.ALIVE]] = board.turn, len(board.food), len(board.alive())
    if len(board.snakes) > games.snakes.shape[1]:
        raise BoardError(
            "{count} snakes on the board; expected at most {shape}.",
            count=len(board.snakes),
            shape=games.snakes.shape[1],
        )
    numbers = {snake.id: number for number, snake in enumerate(board.snakes)}
    for number, snake in enumerate(board.snakes):
        _put_snake(games, g, number, snake, numbers, board)
    for absent in range(len(board.snakes), games.snakes.shape[1]):
        games.snakes[g, absent, [col.CAUSE, col.BY]] = 1, -1
    for x, y in board.food:
        if not board.holds((x, y)):
            raise BoardError(
                "food at {value}; expected squares of a {width}x{height} board.",
                value=(x, y),
                width=board.width,
                height=board.height,
            )
        games.cells[g, col.MEAL, y * board.width + x] = 1
    for (x, y), count in board.hazards.items():
        if board.holds((x, y)):
            games.cells[g, col.HAZARD, y * board.width + x] = count
        elif board.holds((x, y - board.height)):
            games.cells[g, col.NOTE, (y - board.height) * board.width + x] = count
    if state is not None:
        _put_plan(games, g, board, state)


def get_board(games: Games, g: int, settings: GameSettings, ids: list[str] | None = None) -> Board:
    """Return game g as a board; ids are s0, s1 … unless given. Food is in cell order."""
    width, height = settings.width, settings.height
    names = ids or [f"s{number}" for number in range(games.snakes.shape[1])]
    board = Board(width, height, int(games.games[g, col.TURN]))
    board.snakes = [_get_snake(games, g, number, names, width) for number in range(len(names))]
    board.food = [(int(c) % width, int(c) // width) for c in np.flatnonzero(games.cells[g, col.MEAL])]
    hazards: Counter[Point] = Counter()
    for plane, lift in ((col.HAZARD, 0), (col.NOTE, height)):
        for c in np.flatnonzero(games.cells[g, plane]):
            hazards[(int(c) % width, int(c) // width + lift)] = int(games.cells[g, plane, c])
    board.hazards = hazards
    return board


def _most_events(settings: GameSettings) -> int:
    """Return the most changes a hazard plan of this map can hold."""
    chosen = maps.find_map(settings.map)
    return 0 if chosen.plan is maps.hazard_plans.nothing else chosen.changes_per_square * settings.area


def _put_snake(games: Games, g: int, number: int, snake: Snake, numbers: Mapping[str, int], board: Board) -> None:
    row = games.snakes[g, number]
    row[[col.X, col.Y]] = snake.head
    row[[col.LENGTH, col.HEALTH, col.ON]] = len(snake.body), snake.health, snake.on
    row[col.CAUSE], row[col.BY] = CAUSES.index(snake.cause), numbers.get(snake.by, -1)
    if not 2 <= len(snake.body) <= games.bodies.shape[2]:
        raise BoardError(
            "snake {id} has {count} segments; expected 2 to {shape}.",
            id=snake.id,
            count=len(snake.body),
            shape=games.bodies.shape[2],
        )
    for place, (x, y) in enumerate(snake.body):
        cell = y * board.width + x if board.holds((x, y)) else -1
        games.bodies[g, number, place] = cell
        if not snake.alive:
            continue
        if cell < 0 or games.cells[g, col.OWNER, cell] not in (0, number + 1):
            raise BoardError(
                "snake {id} at {value}: off the board or on another living snake.", id=snake.id, value=(x, y)
            )
        games.cells[g, col.OWNER, cell] = number + 1


def _get_snake(games: Games, g: int, number: int, names: list[str], width: int) -> Snake:
    row = games.snakes[g, number]
    places = (row[col.START] + np.arange(row[col.LENGTH])) % games.bodies.shape[2]
    body = [(int(c) % width, int(c) // width) for c in games.bodies[g, number, places]]
    body[:1] = [(int(row[col.X]), int(row[col.Y]))]
    by = names[row[col.BY]] if row[col.BY] >= 0 else ""
    return Snake(names[number], body, int(row[col.HEALTH]), CAUSES[row[col.CAUSE]], by, int(row[col.ON]))


def _put_plan(games: Games, g: int, board: Board, state: maps.MapState) -> None:
    games.sides[g] = 0
    games.sides[g, : len(state.sides)] = state.sides
    changes = [(t, y * board.width + x, n) for t, (x, y), n in state.plan.changes if board.holds((x, y))]
    games.events[g] = np.iinfo(np.int32).max
    if changes:
        games.events[g, : len(changes)] = changes
