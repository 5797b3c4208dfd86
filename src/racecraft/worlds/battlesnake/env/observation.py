"""What a snake sees: one function for training, server and arena.

Planes are uint8 (8, V, V), centred on the head, row 0 at the top; V is odd. On wrapped boards the window shows the
board again and again; elsewhere what lies off the board is wall.

    0 own body            8 for each turn until the square clears (the tail 8, free to enter now), at most 255
    1 other bodies        the same
    2 stronger heads      others' heads at least as long as the own: 127 and 16 for each segment more
    3 weaker heads        others' heads that are shorter: 127 and 16 for each segment less
    4 healths             2.5 for each health, at every head, the own in the middle
    5 food                255
    6 hazards             2.5 for each health they take (or give) a turn, stacked ones together
    7 walls               255

Numbers are float32 (6,): health / 100; length / area; lead over the longest other / 10, within -1 to 1 (1 when alone);
others alive / 16; food / 16; hazard damage / 100.

`action_mask` allows up, down, left, right unless surely fatal: a wall, or a body that will not have moved away. Where
all are fatal all are allowed.

With `outlook` there is a third array beside planes and numbers, float32 (4, 10): what lies behind each of the four
moves, in the order up, down, left, right; zeros where a move is surely fatal. It takes some microseconds a snake, so
worlds show it on demand only; a policy that sees it need not learn to count.

    0 open          1
    1 space         squares that water from there would reach, for each own segment, at most 1
    2 room          the same for each square of the board
    3 territory     of the squares that anybody reaches before the others: the own share
    4 own space     squares reached first for each own segment, at most 1
    5 food          1 / steps to the nearest food, 0 where there is no way
    6 own food      1 / steps to the nearest food reached first
    7 way out       1 / steps to the own tail
    8 meeting       -1 a head at least as long could come there too; 1 only shorter ones could; 0 none
    9 hazard        health it would take / 100, stacked ones together
"""

from __future__ import annotations

import functools

import numpy as np

from racecraft.contract.world import Array, ArraySpec
from racecraft.worlds.battlesnake.env.board import Board, BoardError
from racecraft.worlds.battlesnake.env.kernels.observe import NUM_NUMBERS, NUM_PLANES
from racecraft.worlds.battlesnake.env.kernels.outlook import NUM_OUTLOOKS, outlook_game
from racecraft.worlds.battlesnake.env.kernels.steps import observe_game
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import Games, allocate_games, params_of, put_board

PLANES = ("own_body", "other_bodies", "stronger_heads", "weaker_heads", "healths", "food", "hazards", "walls")
WIDEST_DEFAULT_VIEW = 21


def default_view(width: int, height: int) -> int:
    """Return the side of the window: the whole board from any square, but at most 21 squares.

    >>> default_view(7, 7), default_view(11, 11), default_view(19, 19)
    (13, 21, 21)
    """
    return min(2 * max(width, height) - 1, WIDEST_DEFAULT_VIEW)


def observation_specs(view: int, outlook: bool = False) -> dict[str, ArraySpec]:
    """Return the specs of the observation for a window of `view` squares a side, with or without the outlook."""
    if view < 3 or view % 2 == 0:
        raise BoardError("view is {view}; expected an odd number of squares, at least 3.", view=view)
    specs = {
        "planes": ArraySpec(
            (NUM_PLANES, view, view), np.uint8, 0, 255, doc="Board about the head; see observation.py."
        ),
        "numbers": ArraySpec((NUM_NUMBERS,), np.float32, -1, 1, doc="Health, length, lead, others, food, damage."),
    }
    if outlook:
        specs["outlook"] = ArraySpec((4, NUM_OUTLOOKS), np.float32, -1, 1, doc="What lies behind each move.")
    return specs


def observe_board(
    board: Board, settings: GameSettings, snake_id: str, view: int | None = None, outlook: bool = False
) -> tuple[dict[str, Array], Array]:
    """Return what one snake sees on one board, as the world of training would show it.

    Args:
        board: Any position; eliminated snakes may be left out.
        settings: Size, ruleset and hazard damage; the rest does not matter.
        snake_id: Who looks.
        view: Side of the window, `default_view` if None.
        outlook: Whether to look behind each move, too.

    Returns:
        Named observations and the action mask, bool (4,).

    Raises:
        BoardError: No such snake, a board of another size, or living snakes that overlap.
    """
    if (board.width, board.height) != (settings.width, settings.height):
        raise BoardError(
            "the board is {width}x{height}; expected {width_2}x{height_2}.",
            width=board.width,
            height=board.height,
            width_2=settings.width,
            height_2=settings.height,
        )
    ids = [snake.id for snake in board.snakes]
    if snake_id not in ids:
        raise BoardError(
            "there is no snake '{snake_id}' on the board; there are {ids}.",
            snake_id=snake_id,
            ids=", ".join(ids) or "none",
        )
    games = _single(board, settings)
    rows, number = games.snakes.shape[:2], ids.index(snake_id)
    side = view or default_view(settings.width, settings.height)
    seen = {name: np.zeros(rows + spec.shape, spec.dtype) for name, spec in observation_specs(side, outlook).items()}
    active, mask = np.zeros(rows, bool), np.ones((*rows, 4), bool)
    marks, sheet = allocate_marks(settings, *rows)[0], allocate_sheets(settings, 1, side)[0]
    walls = wall_planes(settings.width, settings.height, side)
    observe_game(
        0, games.bodies, games.snakes, games.games, games.cells, params_of(settings), squares_of(settings), marks,
        sheet, walls, seen["planes"], seen["numbers"], active, mask,
    )  # fmt: skip
    if outlook:
        looks, scratch = np.zeros(rows, bool), allocate_scratch(settings, 1)
        looks[0, number] = True
        outlook_game(
            0, looks, games.bodies, games.snakes, games.cells, params_of(settings), mask, scratch, seen["outlook"]
        )  # fmt: skip
    return {name: array[0, number] for name, array in seen.items()}, mask[0, number]


def allocate_marks(settings: GameSettings, num_games: int, num_snakes: int) -> Array:
    """Return room for the marks of N boards, int32 (N, K, 2); see `kernels.observe.mark`."""
    return np.zeros((num_games, 3 * settings.area + 5 * num_snakes + 1, 2), np.int32)


def allocate_sheets(settings: GameSettings, num_games: int, view: int) -> Array:
    """Return room for the sheets of N boards, uint8 (N, L); see `kernels.sheet.draw`."""
    furthest = (settings.height - 1) * view + settings.width - 1
    return np.zeros((num_games, (NUM_PLANES - 1) * view * view + furthest), np.uint8)


def allocate_scratch(settings: GameSettings, num_games: int) -> Array:
    """Return room for the outlooks of N boards, int32 (N, 5, C); see `kernels.outlook`."""
    return np.zeros((num_games, 5, settings.area), np.int32)


@functools.lru_cache(maxsize=8)
def wall_planes(width: int, height: int, view: int) -> Array:
    """Return the plane of walls for a head on each cell of a board without joined edges, uint8 (C, V * V)."""
    x, y = np.arange(width * height) % width, np.arange(width * height) // width
    offset = np.arange(view) - view // 2
    columns = x[:, None] + offset
    rows = y[:, None] - offset
    seen = ((rows >= 0) & (rows < height))[:, :, None] & ((columns >= 0) & (columns < width))[:, None, :]
    return np.where(seen, 0, 255).astype(np.uint8).reshape(width * height, view * view)


def squares_of(settings: GameSettings) -> Array:
    """Return x and y of every cell, int16 (C, 2)."""
    cells = np.arange(settings.area)
    return np.stack([cells % settings.width, cells // settings.width], axis=1).astype(np.int16)


def _single(board: Board, settings: GameSettings) -> Games:
    seats = GameSettings(board.width, board.height, max(1, len(board.snakes)), settings.ruleset)
    games = allocate_games(seats, 1)
    put_board(games, 0, board)
    return games
