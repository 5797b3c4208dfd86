"""Where snakes start and where the first food lies (facts: A.6, A.7).

The kernel's `begin_standard` rolls the same dice in the same order for the common case: a square board of side 7 or
more with up to 8 snakes.
"""

from __future__ import annotations

from racecraft.worlds.battlesnake.env.board import START_LENGTH, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.dice import Dice, sample, shuffle
from racecraft.worlds.battlesnake.env.layouts import Layout


def place_snakes(board: Board, heads: list[Point]) -> None:
    """Put one snake of three stacked segments on every square; ids are s0, s1, s2."""
    board.snakes = [Snake(f"s{number}", [head] * START_LENGTH) for number, head in enumerate(heads)]


def standard_heads(board: Board, players: int, dice: Dice) -> list[Point]:
    """Return start squares of the standard maps: fixed, distributed or random by size and number of players."""
    square = board.width == board.height
    if square and players <= 8 and board.width >= 7:
        return _fixed(board.width, dice)[:players]
    if square and board.width >= 11:
        return _in_turn(_quadrants(board.width), players, dice)
    if players > 8 and min(board.width, board.height) < 7:
        raise BoardError(
            "{players} snakes on {width}x{height}; expected at most 8 on so small a board.",
            players=players,
            width=board.width,
            height=board.height,
        )
    places = [p for p in board.squares() if (p[0] + p[1]) % 2 == 0 and p != board.centre()]
    if len(places) < players:
        raise BoardError(
            "{players} snakes on {width}x{height}; there are {count} start squares.",
            players=players,
            width=board.width,
            height=board.height,
            count=len(places),
        )
    return sample(places, players, dice)


def layout_heads(drawn: Layout, players: int, dice: Dice) -> list[Point]:
    """Return start squares of a drawn map."""
    if drawn.quadrants:
        return _in_turn([list(squares) for squares in drawn.quadrants], players, dice)
    fitting = [squares for most, squares in drawn.starts if players <= most] or [drawn.starts[-1][1]]
    places = list(fitting[0])
    shuffle(places, dice)
    return [*places, *drawn.extra_starts][:players]


def standard_food(board: Board, dice: Dice) -> None:
    """Lay the first food: beside every snake and in the centre, or anywhere on boards where that has no room."""
    if board.width != board.height or board.width < 7:
        board.food.extend(sample(board.free_squares(), len(board.snakes), dice))
        return
    if len(board.snakes) <= 4 or board.width * board.height >= 121:
        food_beside_heads(board, dice)
    if all(board.centre() not in snake.body for snake in board.snakes):
        board.food.append(board.centre())


def food_beside_heads(board: Board, dice: Dice, spare_hazards: bool = False) -> None:
    """Lay one food for every snake on a square diagonal to its head, on the side away from the centre."""
    corners = {(x, y) for x in (0, board.width - 1) for y in (0, board.height - 1)}
    for snake in board.snakes:
        x, y = snake.head
        places = [(x + dx, y + dy) for dx in (-1, 1) for dy in (-1, 1)]
        taken = {*board.food, *corners, board.centre()}
        places = [p for p in places if p not in taken and board.holds(p) and _is_farther(p, snake.head, board.centre())]
        if spare_hazards:
            places = [p for p in places if not board.hazards[p]]
        board.food.extend(sample(places, 1, dice))


def _is_farther(place: Point, head: Point, centre: Point) -> bool:
    """Tell whether a place is farther from the centre than the head on at least one axis."""
    return any(abs(place[axis] - centre[axis]) > abs(head[axis] - centre[axis]) for axis in (0, 1))


def _fixed(side: int, dice: Dice) -> list[Point]:
    low, middle, high = 1, (side - 1) // 2, side - 2
    corners = [(low, low), (low, high), (high, low), (high, high)]
    cardinals = [(low, middle), (middle, low), (middle, high), (high, middle)]
    shuffle(corners, dice)
    shuffle(cardinals, dice)
    return [*corners, *cardinals] if dice.below(2) == 0 else [*cardinals, *corners]


def _quadrants(side: int) -> list[list[Point]]:
    near = (side // 2) // 3
    low = (near, side // 2 - near)
    high = tuple(side - 1 - offset for offset in low)
    return [[(x, y) for x in xs for y in ys] for ys in (low, high) for xs in (low, high)]


def _in_turn(quadrants: list[list[Point]], players: int, dice: Dice) -> list[Point]:
    """Deal out squares quadrant by quadrant, from a random one on, a random square each."""
    rest = [list(squares) for squares in quadrants]
    first = dice.below(len(rest))
    turn = [rest[(first + number) % len(rest)] for number in range(players)]
    return [squares.pop(dice.below(len(squares))) for squares in turn]
