"""The 25 official maps: who may play where, what stands at set-up, what happens after each turn.

A map is a row of `MAPS`: how snakes start, how food falls, how hazards come. Rules and map take turns: the ruleset's
stages first, then `after_turn` (food, then hazards, at the *old* turn number), then the turn is counted up.
Facts: A.8, A.9; squares and schedules checked against the recorded output of every map.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from racecraft.contract.errors import nearest
from racecraft.worlds.battlesnake.env import hazard_plans, solo_maze
from racecraft.worlds.battlesnake.env.board import Board, BoardError, Point, neighbours
from racecraft.worlds.battlesnake.env.dice import Dice, sample
from racecraft.worlds.battlesnake.env.hazard_plans import Plan, Planner
from racecraft.worlds.battlesnake.env.layouts import layout
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import outside_safe_zone
from racecraft.worlds.battlesnake.env.starts import (
    food_beside_heads,
    layout_heads,
    place_snakes,
    standard_food,
    standard_heads,
)

ODD_SIZES = tuple((side, side) for side in range(7, 26, 2))

FoodRule = Callable[[Board, GameSettings, Dice], None]


@dataclass(frozen=True)
class GameMap:
    """One map; the words are those of its declaration."""

    id: str
    sizes: tuple[tuple[int, int], ...] = ODD_SIZES
    """Declared sizes."""
    most_players: int = 16
    strict: bool = False
    """Whether other sizes are refused; where not, the standard start rules make do with any board."""
    hazards: str = "plan"
    """What rules the hazards: "plan", "royale", "snail" or "maze"."""
    plan: Planner = hazard_plans.nothing
    changes_per_square: int = 1
    """Most changes of a square that `plan` may hold."""
    start_food: str = "standard"
    """First food: "standard", "beside heads", "none" or "arcade"."""
    food: str = "standard"
    """Later food: "none", "standard", "off hazards", "arcade" or "castle"."""
    castle_food: int = 0
    """Most food at a time under the castle rule."""
    drawn: bool = False
    """Whether `layouts.toml` has its start squares."""

    @property
    def is_fixed(self) -> bool:
        """Whether its plan stands from the start and never changes."""
        return self.plan in hazard_plans.FIXED

    @property
    def has_dice(self) -> bool:
        """Whether dice decide where hazards of its plan come."""
        return self.plan not in hazard_plans.WITHOUT_DICE

    def check(self, settings: GameSettings) -> None:
        """Refuse a size, a number of players or a schedule that this map cannot be played with."""
        size = (settings.width, settings.height)
        if self.strict and size not in self.sizes:
            known = ", ".join(f"{w}x{h}" for w, h in self.sizes)
            raise BoardError(
                "map {id} on {size}x{size_2}; expected {known}.", id=self.id, size=size[0], size_2=size[1], known=known
            )
        if settings.players > self.most_players:
            raise BoardError(
                "map {id} with {players} snakes; expected at most {most_players}.",
                id=self.id,
                players=settings.players,
                most_players=self.most_players,
            )
        if self.id == "solo_maze" and min(size) < 7:
            raise BoardError("map solo_maze on {size}x{size_2}; expected at least 7x7.", size=size[0], size_2=size[1])
        if settings.shrink_every < 1 and (self.id in ("royale", "hz_hazard_pits") or settings.ruleset == "royale"):
            raise BoardError(
                "{id}: hazards every {shrink_every} turns; expected at least 1.",
                id=self.id,
                shrink_every=settings.shrink_every,
            )


@dataclass
class MapState:
    """What a map remembers of one game."""

    plan: Plan
    sides: list[int]
    """The game's royale shrinks (see `stages.Table.sides`)."""


def find_map(name: str) -> GameMap:
    """Return a map by its id; an unknown id is refused with the nearest known one."""
    if name not in MAPS:
        raise BoardError("There is no map '{name}'. {hint}", name=name, hint=nearest(name, MAPS))
    return MAPS[name]


def set_up(settings: GameSettings, dice: Dice) -> tuple[Board, MapState]:
    """Return the board before the first turn and what the map keeps in mind.

    Dice are rolled for start squares, first food, the hazard plan, the royale sides: in this order.
    """
    chosen = find_map(settings.map)
    chosen.check(settings)
    board = Board(settings.width, settings.height)
    if chosen.hazards == "maze":
        place_snakes(board, [(0, 0)])
        solo_maze.build_level(board, 0, dice)
        return board, MapState(Plan(board.hazards.copy()), [])
    if chosen.drawn:
        place_snakes(board, layout_heads(layout(chosen.id), settings.players, dice))
        board.hazards = layout(chosen.id).hazard_counts()
    else:
        place_snakes(board, standard_heads(board, settings.players, dice))
    _place_first_food(chosen, board, settings, dice)
    plan = chosen.plan(settings, dice)
    board.hazards += plan.start
    royale = chosen.hazards == "royale" or settings.ruleset == "royale"
    return board, MapState(plan, hazard_plans.royale_sides(settings, dice) if royale else [])


def after_turn(board: Board, settings: GameSettings, state: MapState, dice: Dice) -> None:
    """Let food fall and hazards change after the rules of a turn; the board still shows the old turn."""
    chosen = find_map(settings.map)
    if chosen.hazards == "maze":
        solo_maze.after_turn(board, dice)
        return
    FOOD_RULES[chosen.food](board, settings, dice)
    move_hazards(board, settings, state)


def move_hazards(board: Board, settings: GameSettings, state: MapState) -> None:
    """Change hazards as the map does after the turn the board shows (solo_maze has its own way)."""
    chosen = find_map(settings.map)
    if chosen.hazards == "royale":
        board.hazards = outside_safe_zone(board, state.sides[: (board.turn + 1) // settings.shrink_every])
    elif chosen.hazards == "snail":
        _leave_trails(board)
    else:
        state.plan.reveal(board)


def no_food(board: Board, settings: GameSettings, dice: Dice) -> None:
    """Let none fall."""


def standard_food_rule(board: Board, settings: GameSettings, dice: Dice, spare_hazards: bool = False) -> None:
    """Fill food up to the minimum; else add one with a probability of (chance - 1) percent.

    The engine compares 100 less a roll of 0 to 99 with the chance: 15 gives 14 %, 100 gives 99 %, 1 gives none.
    """
    missing = settings.minimum_food - len(board.food)
    if missing <= 0:
        missing = int(100 - dice.below(100) < settings.food_spawn_chance)
    if missing:
        board.food.extend(sample(board.free_squares(spare_hazards), missing, dice))


def off_hazards_food_rule(board: Board, settings: GameSettings, dice: Dice) -> None:
    """As the standard rule, but never on a hazard."""
    standard_food_rule(board, settings, dice, spare_hazards=True)


def arcade_food_rule(board: Board, settings: GameSettings, dice: Dice) -> None:
    """Add one on a listed square with a probability of (chance + 1) percent; chance 0 gives none."""
    if settings.food_spawn_chance and dice.below(100) <= settings.food_spawn_chance:
        taken = {*board.food, *(point for snake in board.alive() for point in snake.body)}
        board.food.extend(sample([p for p in layout("arcade_maze").food if p not in taken], 1, dice))


def castle_food_rule(board: Board, settings: GameSettings, dice: Dice) -> None:
    """From turn 10 on add one on a listed square while there is less than the most; chance has no say.

    Never under a snake, beside a living head, or in the passage of another food (the next square).
    """
    if board.turn < 10 or len(board.food) >= find_map(settings.map).castle_food:
        return
    taken: set[Point] = set(board.food)
    for point in board.food:
        taken.update(neighbours(point))
    for snake in board.alive():
        taken.update([*snake.body, *neighbours(snake.head)])
    board.food.extend(sample([p for p in layout(settings.map).food if p not in taken], 1, dice))


FOOD_RULES: dict[str, FoodRule] = {
    "none": no_food,
    "standard": standard_food_rule,
    "off hazards": off_hazards_food_rule,
    "arcade": arcade_food_rule,
    "castle": castle_food_rule,
}


def _place_first_food(chosen: GameMap, board: Board, settings: GameSettings, dice: Dice) -> None:
    if chosen.start_food == "standard":
        standard_food(board, dice)
    elif chosen.start_food == "beside heads":
        food_beside_heads(board, dice, spare_hazards=True)
    elif chosen.start_food == "arcade" and settings.minimum_food > 0:
        board.food.append((9, 11))


def _leave_trails(board: Board) -> None:
    """snail_mode: old trails fade by one, last turn's notes become trails, tails note new ones off the board.

    A note at (x, y + height) holds as many hazards as the snake is long. A doubled tail leaves none; where a living
    head stands no note becomes a trail.
    """
    heads = {snake.head for snake in board.alive()}
    notes = {(x, y - board.height): n for (x, y), n in board.hazards.items() if y >= board.height}
    faded = {point: n - 1 for point, n in board.hazards.items() if board.holds(point) and n > 1}
    board.hazards.clear()
    board.hazards.update(faded)
    for point, count in notes.items():
        if point not in heads:
            board.hazards[point] += count
    board.hazards.update(pending_trails(board))


def pending_trails(board: Board) -> Counter[Point]:
    """Return the notes that snail_mode keeps off the board: squares whose trail the next turn lays."""
    notes: Counter[Point] = Counter()
    for snake in board.alive():
        x, y = snake.body[-1]
        if len(snake.body) > 1 and snake.body[-1] != snake.body[-2]:
            notes[(x, y + board.height)] += len(snake.body)
    return notes


def _castle(name: str, side: int, most_players: int, most_food: int) -> GameMap:
    return GameMap(
        name, ((side, side),), most_players, True,
        start_food="none", food="castle", castle_food=most_food, drawn=True,
    )  # fmt: skip


def _bridges(name: str, side: int, most_players: int) -> GameMap:
    return GameMap(name, ((side, side),), most_players, True, start_food="beside heads", food="off hazards", drawn=True)


_MEDIUM = ((7, 7), (11, 11), (19, 19))
_MAZES = ((7, 7), (11, 11), (19, 19), (19, 21), (25, 25))

MAPS = {
    row.id: row
    for row in (
        GameMap("standard"),
        GameMap("empty", start_food="none", food="none"),
        GameMap("royale", hazards="royale"),
        GameMap("arcade_maze", ((19, 21),), 6, True, start_food="arcade", food="arcade", drawn=True),
        GameMap("solo_maze", _MAZES, 1, hazards="maze", start_food="none", food="none"),
        GameMap("snail_mode", hazards="snail"),
        GameMap("sinkholes", _MEDIUM, 8, True, plan=hazard_plans.sinkholes, changes_per_square=8),
        GameMap("healing_pools", _MEDIUM, 8, True, plan=hazard_plans.healing_pools),
        GameMap(
            "hz_hazard_pits", ((11, 11),), 4, True, plan=hazard_plans.hazard_pits, changes_per_square=100, drawn=True
        ),
        GameMap("hz_inner_wall", plan=hazard_plans.inner_wall),
        GameMap("hz_rings", plan=hazard_plans.rings),
        GameMap("hz_columns", plan=hazard_plans.columns),
        GameMap("hz_spiral", plan=hazard_plans.spiral),
        GameMap("hz_scatter", plan=hazard_plans.scatter),
        GameMap("hz_grow_box", plan=hazard_plans.grow_box),
        GameMap("hz_expand_box", plan=hazard_plans.expand_box),
        GameMap("hz_expand_scatter", plan=hazard_plans.expand_scatter),
        _castle("hz_castle_wall", 11, 8, 2),
        _castle("hz_castle_wall_lg", 19, 8, 2),
        _castle("hz_castle_wall_xl", 25, 12, 4),
        _bridges("hz_rivers_bridges", 11, 8),
        _bridges("hz_rivers_bridges_lg", 19, 12),
        _bridges("hz_rivers_bridges_xl", 25, 12),
        _bridges("hz_islands_bridges", 11, 4),
        _bridges("hz_islands_bridges_lg", 19, 16),
    )
}
