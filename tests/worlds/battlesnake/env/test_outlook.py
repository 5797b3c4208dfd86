"""What lies behind each move: worked out by hand on small boards."""

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.world import allocate
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.observation import observe_board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings

UP, DOWN, LEFT, RIGHT = range(4)
OPEN, SPACE, ROOM, TERRITORY, OWN_SPACE, FOOD, OWN_FOOD, WAY_OUT, MEETING, HAZARD = range(10)


class TestWorldWithOutlook(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 3), num_worlds, max_turns=40, view=5, outlook=True))


def outlook(*bodies, food=(), size=7, ruleset="standard", hazards=None):
    snakes = [Snake(f"s{number}", list(body), 100) for number, body in enumerate(bodies)]
    board = Board(size, size, 5, snakes, list(food), dict(hazards or {}))
    seen, _ = observe_board(board, GameSettings(size, size, max(1, len(bodies)), ruleset), "s0", 11, outlook=True)
    return seen["outlook"]


def test_a_pocket_is_told_from_the_open():
    # A wall of the own body: right of the head lies a column of 1 x 3 squares that nothing opens in time.
    body = [(1, 0), (1, 1), (1, 2), (1, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (6, 4)]
    seen = outlook(body)
    assert seen[LEFT, ROOM] == pytest.approx(3 / 49), "(0, 0), (0, 1), (0, 2); segment (0, 3) opens in 8 turns"
    assert seen[RIGHT, ROOM] > 0.3
    assert seen[LEFT, SPACE] == pytest.approx(3 / 12)
    assert seen[LEFT, OWN_SPACE] == pytest.approx(3 / 12), "nobody else comes there"
    assert (seen[[UP, DOWN]] == 0).all(), "a body and a wall"


def test_food_is_as_near_as_its_steps():
    seen = outlook([(3, 3), (3, 2), (3, 1)], food=[(5, 3)])
    assert seen[RIGHT, FOOD] == pytest.approx(1 / 2)
    assert seen[UP, FOOD] == pytest.approx(1 / 4), "up, right, right, down"
    assert seen[LEFT, FOOD] == pytest.approx(1 / 6), "(2, 3), (2, 4), (3, 4), (4, 4), (5, 4), (5, 3)"


def test_food_on_the_very_next_square_is_one_step_away_and_the_own():
    seen = outlook([(3, 3), (3, 2), (3, 1)], food=[(4, 3)])
    assert (seen[RIGHT, FOOD], seen[RIGHT, OWN_FOOD]) == (1.0, 1.0)


def test_territory_is_the_share_reached_first_and_falls_with_distance():
    seen = outlook([(1, 3), (0, 3), (0, 2)], [(5, 3), (6, 3), (6, 2)])
    assert seen[RIGHT, TERRITORY] > seen[UP, TERRITORY] > 0.3
    alone = outlook([(1, 3), (0, 3), (0, 2)])
    assert alone[RIGHT, TERRITORY] == 1.0


def test_food_of_another_is_not_own_food():
    seen = outlook([(1, 3), (0, 3), (0, 2)], [(5, 3), (6, 3), (6, 2)], food=[(5, 4)])
    assert seen[UP, FOOD] > 0
    assert seen[UP, OWN_FOOD] == 0


def test_meetings_are_told_by_strength():
    own = [(2, 3), (1, 3), (0, 3)]
    assert outlook(own, [(4, 3), (5, 3), (6, 3)])[RIGHT, MEETING] == -1, "equal lengths kill both"
    assert outlook([*own, (0, 2)], [(4, 3), (5, 3), (6, 3)])[RIGHT, MEETING] == 1
    assert outlook(own, [(5, 3), (6, 3), (6, 2)])[RIGHT, MEETING] == 0
    both = outlook([*own, (0, 2)], [(3, 4), (4, 4), (5, 4)], [(3, 2), (4, 2), (5, 2), (6, 2)])
    assert both[RIGHT, MEETING] == -1, "one who is stronger is enough"


def test_a_hazard_is_told_by_the_health_it_takes():
    seen = outlook([(3, 3), (3, 2), (3, 1)], hazards={(4, 3): 2}, ruleset="royale")
    assert seen[RIGHT, HAZARD] == pytest.approx(0.28)
    assert seen[UP, HAZARD] == 0


def test_the_way_to_the_own_tail():
    ring = outlook([(2, 2), (2, 3), (3, 3), (3, 2)])
    assert ring[RIGHT, WAY_OUT] == 1.0, "the tail itself, which moves on"


def test_only_who_looks_is_told():
    world = BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 2), num_games=3, view=5, outlook=True))
    every, some = allocate(world.spec), allocate(world.spec)
    world.reset(every, 1)
    world.looks[:, 1] = False
    world.reset(some, 1)
    told, not_told = some.observations["outlook"][:, 0], some.observations["outlook"][:, 1]
    assert np.array_equal(told, every.observations["outlook"][:, 0])
    assert not not_told.any()
    assert every.observations["outlook"][:, 1].any()
