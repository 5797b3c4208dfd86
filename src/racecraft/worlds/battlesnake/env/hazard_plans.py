"""Hazards as plans: drawn once per game, revealed over time (facts: A.9; checked against recorded plans of every map).

A plan's change at turn T happens after the moves of turn T and hurts from turn T + 1 on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from racecraft.worlds.battlesnake.env.board import Board, Point
from racecraft.worlds.battlesnake.env.dice import Dice, shuffle
from racecraft.worlds.battlesnake.env.settings import GameSettings


@dataclass
class Plan:
    """Everything the hazards of one game will do by themselves."""

    start: Counter[Point] = field(default_factory=Counter)
    """Hazards on the board at set-up."""
    changes: list[tuple[int, Point, int]] = field(default_factory=list)
    """(Turn, square, hazards added), by turn; a negative number takes away."""

    def reveal(self, board: Board) -> None:
        """Do what is planned for the board's turn."""
        for turn, point, added in self.changes:
            if turn == board.turn:
                board.hazards[point] = max(0, board.hazards[point] + added)
                if board.hazards[point] == 0:
                    del board.hazards[point]


Planner = Callable[[GameSettings, Dice], Plan]


def nothing(settings: GameSettings, dice: Dice) -> Plan:
    """No hazards."""
    return Plan()


def rings(settings: GameSettings, dice: Dice) -> Plan:
    """Rings one square thick, 1, 3, 5 … squares from the edge, while less than half the width."""
    start: Counter[Point] = Counter()
    for inset in range(1, settings.width // 2 - 1, 2):
        start.update(_frame(settings, inset))
    return Plan(start)


def inner_wall(settings: GameSettings, dice: Dice) -> Plan:
    """One ring a square away from the edge."""
    return Plan(Counter(_frame(settings, 1)))


def columns(settings: GameSettings, dice: Dice) -> Plan:
    """Every square with two odd coordinates."""
    return Plan(Counter(p for p in _squares(settings) if p[0] % 2 and p[1] % 2))


def spiral(settings: GameSettings, dice: Dice) -> Plan:
    """A clockwise spiral from a square in the middle 40 %, a step every 3 turns; steps off the board pass unseen."""
    x = _between(dice, 3 * settings.width // 10, 7 * settings.width // 10)
    y = _between(dice, 3 * settings.height // 10, 7 * settings.height // 10)
    changes, turn, leg = [(2, (x, y), 1)], 2, 0
    while len(changes) < settings.area:
        dx, dy = ((0, 1), (1, 0), (0, -1), (-1, 0))[leg % 4]
        for _ in range(leg // 2 + 1):
            x, y, turn = x + dx, y + dy, turn + 3
            if _on_board(settings, (x, y)):
                changes.append((turn, (x, y), 1))
        leg += 1
    return Plan(changes=changes)


def scatter(settings: GameSettings, dice: Dice) -> Plan:
    """Every square in random order, one every 2 turns from turn 1 (the engine fails once the board is full)."""
    squares = _squares(settings)
    shuffle(squares, dice)
    return Plan(changes=[(1 + 2 * number, point, 1) for number, point in enumerate(squares)])


def grow_box(settings: GameSettings, dice: Dice) -> Plan:
    """A square from turn 0; every 12 turns the box grows by one side that still can."""
    x = _between(dice, 2, settings.width - 2)
    y = _between(dice, 2, settings.height - 2)
    box, changes, turn = [x, x, y, y], [(0, (x, y), 1)], 0
    while open_sides := [s for s, edge in enumerate((0, settings.width - 1, 0, settings.height - 1)) if box[s] != edge]:
        side, turn = open_sides[dice.below(len(open_sides))], turn + 12
        box[side] += 1 if side % 2 else -1
        xs = range(box[0], box[1] + 1) if side >= 2 else [box[side]]
        ys = range(box[2], box[3] + 1) if side < 2 else [box[side]]
        changes += [(turn, (x, y), 1) for y in ys for x in xs]
    return Plan(changes=changes)


def expand_box(settings: GameSettings, dice: Dice) -> Plan:
    """Rings about a random square, the next one every 20 turns; both coordinates are drawn from the width."""
    x, y = (_between(dice, 2, settings.width - 2) for _ in range(2))
    changes = [(0, (x, y), 1)]
    for radius in range(1, max(settings.width, settings.height)):
        changes += [(20 * radius, point, 1) for point in _ring(settings, (x, y), radius)]
    return Plan(changes=changes)


def expand_scatter(settings: GameSettings, dice: Dice) -> Plan:
    """Rings about a random square, each shuffled, a square every 2 turns; both coordinates are drawn from the width."""
    x, y = (_between(dice, 1, settings.width - 1) for _ in range(2))
    order = [(x, y)]
    for radius in range(1, max(settings.width, settings.height)):
        ring = _ring(settings, (x, y), radius)
        shuffle(ring, dice)
        order += ring
    return Plan(changes=[(2 * number, point, 1) for number, point in enumerate(order)])


def sinkholes(settings: GameSettings, dice: Dice) -> Plan:
    """Rounded squares that grow about the centre and stack, every `shrink_every` turns (10 where that is 0)."""
    every = settings.shrink_every or 10
    reach = {7: 2, 11: 4, 19: 6}[settings.width]
    middle = settings.width // 2
    changes = []
    for radius in range(reach + 1):
        offsets = range(-radius, radius + 1)
        squares = [(dx, dy) for dy in offsets for dx in offsets if radius == 0 or abs(dx) + abs(dy) < 2 * radius]
        changes += [(1 + radius * every, (middle + dx, middle + dy), 1) for dx, dy in squares]
    return Plan(changes=changes)


POOLS: dict[int, tuple[tuple[Point, ...], ...]] = {
    7: (((3, 3),),),
    11: (((3, 3), (7, 7)), ((7, 3), (3, 7)), ((5, 3), (5, 7)), ((3, 5), (7, 5))),
    19: (((5, 5), (13, 5), (5, 13), (13, 13)), ((10, 5), (5, 10), (13, 10), (10, 13))),
}
"""Choices of squares by board side, as recorded (the last one's asymmetry included)."""


def healing_pools(settings: GameSettings, dice: Dice) -> Plan:
    """One, two or four pools; every `shrink_every` turns one dries up.

    On 11x11 every record lets the first of the two go first; with four pools any may go.
    """
    pools = list(POOLS[settings.width][dice.below(len(POOLS[settings.width]))])
    plan = Plan(Counter(pools))
    turn = settings.shrink_every
    while pools and turn > 0:
        gone = pools.pop(dice.below(len(pools)) if settings.width == 19 else 0)
        plan.changes.append((turn, gone, -1))
        turn += settings.shrink_every
    return plan


def hazard_pits(settings: GameSettings, dice: Dice) -> Plan:
    """Pits on odd squares but the starts: four layers fill one by one, stay, and drain; 20 rounds are planned."""
    starts = {(x, y) for x in (1, settings.width - 2) for y in (1, settings.height - 2)}
    pits = [p for p in _squares(settings) if p[0] % 2 and p[1] % 2 and p not in starts]
    changes = []
    for tick in range(1, 141):
        added = {0: -4, 1: 1, 2: 1, 3: 1, 4: 1}.get(tick % 7, 0)
        changes += [(tick * settings.shrink_every, pit, added) for pit in pits if added]
    return Plan(changes=changes)


FIXED = (nothing, rings, inner_wall, columns)
"""Planners whose hazards stand from the start and never change, without dice."""
WITHOUT_DICE = (*FIXED, sinkholes, hazard_pits)
"""Planners that settings alone decide."""


def royale_sides(settings: GameSettings, dice: Dice) -> list[int]:
    """Draw the sides that close in, one per shrink, until nothing is left: 0 left, 1 right, 2 bottom, 3 top."""
    sides: list[int] = []
    width, height = settings.width, settings.height
    while width > 0 and height > 0:
        sides.append(dice.below(4))
        width, height = width - (sides[-1] < 2), height - (sides[-1] >= 2)
    return sides


def _between(dice: Dice, low: int, high: int) -> int:
    return low + dice.below(high - low + 1)


def _squares(settings: GameSettings) -> list[Point]:
    return [(x, y) for y in range(settings.height) for x in range(settings.width)]


def _on_board(settings: GameSettings, point: Point) -> bool:
    return 0 <= point[0] < settings.width and 0 <= point[1] < settings.height


def _frame(settings: GameSettings, inset: int) -> list[Point]:
    xs, ys = (inset, settings.width - 1 - inset), (inset, settings.height - 1 - inset)
    inside = [p for p in _squares(settings) if xs[0] <= p[0] <= xs[1] and ys[0] <= p[1] <= ys[1]]
    return [p for p in inside if p[0] in xs or p[1] in ys]


def _ring(settings: GameSettings, centre: Point, radius: int) -> list[Point]:
    return [p for p in _squares(settings) if max(abs(p[0] - centre[0]), abs(p[1] - centre[1])) == radius]
