"""By hand: each plan of hazards on a board small enough to draw, with dice that fall as they are told."""

from collections import Counter

import pytest

from racecraft.worlds.battlesnake.env import hazard_plans
from racecraft.worlds.battlesnake.env.board import Board, draw
from racecraft.worlds.battlesnake.env.dice import LoadedDice
from racecraft.worlds.battlesnake.env.hazard_plans import Plan
from racecraft.worlds.battlesnake.env.settings import GameSettings


def drawn(plan, width, height):
    """The hazards at set-up, the top row first."""
    return draw(Board(width, height, hazards=Counter(plan.start))).splitlines()


def by_turn(plan):
    """The squares of each turn in their order; every change adds one hazard."""
    turns = {}
    for turn, square, added in plan.changes:
        assert added == 1
        turns.setdefault(turn, []).append(square)
    return turns


def test_a_plan_adds_and_takes_away_on_its_turn_alone_and_never_below_none():
    plan = Plan(changes=[(3, (0, 0), 1), (3, (1, 0), 1), (3, (2, 0), -1), (4, (0, 0), -4), (4, (1, 0), -1)])
    board = Board(3, 3, 2, hazards=Counter({(1, 0): 1}))
    told = []
    for board.turn in (2, 3, 4, 5):
        plan.reveal(board)
        told.append(dict(board.hazards))
    assert told == [{(1, 0): 1}, {(0, 0): 1, (1, 0): 2}, {(1, 0): 1}, {(1, 0): 1}]


def test_a_spiral_s_steps_off_the_board_take_their_time_unseen():
    """From the lower left corner: up, right, down 2, left 2, up 3, right 3, down 4; seven steps lie outside."""
    plan = hazard_plans.spiral(GameSettings(3, 3), LoadedDice([0, 0]))
    seen = {2: (0, 0), 5: (0, 1), 8: (1, 1), 11: (1, 0), 32: (0, 2), 35: (1, 2), 38: (2, 2), 41: (2, 1), 44: (2, 0)}
    assert by_turn(plan) == {turn: [square] for turn, square in seen.items()}


@pytest.mark.parametrize(
    ("planner", "lowest", "highest"),
    [
        (hazard_plans.spiral, (3, 5), (7, 13)),  # the middle 40 % of 11 and of 19 squares
        (hazard_plans.grow_box, (2, 2), (9, 17)),
        (hazard_plans.expand_box, (2, 2), (9, 9)),  # both are drawn from the width
        (hazard_plans.expand_scatter, (1, 1), (10, 10)),
    ],
)
def test_where_a_plan_may_begin(planner, lowest, highest):
    settings = GameSettings(11, 19)
    assert planner(settings, LoadedDice([0, 0])).changes[0][1] == lowest
    assert planner(settings, LoadedDice([99, 99])).changes[0][1] == highest


def test_a_scatter_takes_every_square_once_from_turn_1_on_every_other_turn():
    """Dice that always fall low turn the nine squares round by one."""
    plan = hazard_plans.scatter(GameSettings(3, 3), LoadedDice())
    squares = [(1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2), (0, 0)]
    assert by_turn(plan) == {1 + 2 * number: [square] for number, square in enumerate(squares)}


def test_a_box_grows_by_one_open_side_every_12_turns():
    """On 5 x 4 squares from (3, 2): up, down, right; then, with low dice, left until the edge, and down."""
    plan = hazard_plans.grow_box(GameSettings(5, 4), LoadedDice([1, 0, 3, 2, 1]))
    assert by_turn(plan) == {
        0: [(3, 2)],
        12: [(3, 3)],
        24: [(3, 1)],
        36: [(4, 1), (4, 2), (4, 3)],
        48: [(2, 1), (2, 2), (2, 3)],
        60: [(1, 1), (1, 2), (1, 3)],
        72: [(0, 1), (0, 2), (0, 3)],
        84: [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0)],
    }


def test_a_scatter_expands_ring_by_ring_a_square_every_other_turn():
    """Low dice turn a ring round by one; the furthest corner is as far as the board is long."""
    middle = hazard_plans.expand_scatter(GameSettings(3, 3), LoadedDice())
    squares = [(1, 1), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2), (0, 0)]
    assert by_turn(middle) == {2 * number: [square] for number, square in enumerate(squares)}
    corner = hazard_plans.expand_scatter(GameSettings(3, 3), LoadedDice([1, 1]))
    squares = [(2, 2), (2, 1), (1, 2), (1, 1), (1, 0), (2, 0), (0, 1), (0, 2), (0, 0)]
    assert by_turn(corner) == {2 * number: [square] for number, square in enumerate(squares)}


@pytest.mark.parametrize(("shrink_every", "period"), [(4, 4), (1, 1), (0, 10)])
def test_sinkholes_are_squares_without_corners_about_the_middle(shrink_every, period):
    plan = hazard_plans.sinkholes(GameSettings(7, 7, shrink_every=shrink_every), LoadedDice())
    turns = by_turn(plan)
    assert sorted(turns) == [1, 1 + period, 1 + 2 * period]
    depth = Counter(square for _, square, _ in plan.changes)
    assert drawn(Plan(depth), 7, 7) == [".......", "..111..", ".11211.", ".12321.", ".11211.", "..111..", "......."]
    assert [len(turns[turn]) for turn in sorted(turns)] == [1, 5, 21]


def test_healing_pools_dry_up_one_after_the_other():
    """Of the second choice: the first of two on 11 x 11, any of four on 19 x 19, the only one on 7 x 7."""

    def pools(side, rolls, shrink_every=25):
        plan = hazard_plans.healing_pools(GameSettings(side, side, shrink_every=shrink_every), LoadedDice(rolls))
        return plan.start, plan.changes

    assert pools(7, []) == (Counter({(3, 3): 1}), [(25, (3, 3), -1)])
    two = Counter({(7, 3): 1, (3, 7): 1})
    assert pools(11, [1, 1, 1]) == (two, [(25, (7, 3), -1), (50, (3, 7), -1)])
    assert pools(11, [1], shrink_every=1) == (two, [(1, (7, 3), -1), (2, (3, 7), -1)])
    assert pools(11, [1], shrink_every=0) == (two, []), "they never dry up"
    four = [(10, 5), (5, 10), (13, 10), (10, 13)]
    dried = [(30, (13, 10), -1), (60, (5, 10), -1), (90, (10, 5), -1), (120, (10, 13), -1)]
    assert pools(19, [1, 2, 1], shrink_every=30) == (Counter(four), dried)
