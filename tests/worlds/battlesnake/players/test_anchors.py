"""Anchors: the compiled players are the readable ones, move for move."""

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings
from racecraft.worlds.battlesnake.players.anchors import ANCHORS, AnchorSeats
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves

GAMES = 6


@pytest.mark.parametrize("ruleset", ["standard", "wrapped", "royale", "constrictor"])
def test_compiled_anchors_choose_what_the_readable_players_choose(ruleset):
    names = [["hungry", "flood_fill", "random_safe"], ["flood_fill", "random_safe", "flood_fill"]] * (GAMES // 2)
    world = BattlesnakeWorld(WorldSettings(GameSettings(9, 9, 3, ruleset), num_games=GAMES))
    seats, buffers, moves = AnchorSeats(names, world), allocate(world.spec), np.zeros((GAMES, 3), np.int64)
    readable = {name: find_player(name) for name in ANCHORS}
    world.reset(buffers, 3)
    seats.begin(3)
    asked = 0
    for _ in range(40):
        seats.choose(moves)
        for game in range(GAMES):
            board = world.board(game)
            for number, snake in enumerate(board.snakes):
                if not snake.alive:
                    continue
                name, chosen = names[game][number], MOVES[moves[game, number]]
                if name == "random_safe":
                    assert chosen in (safe_moves(board, world.game_settings, snake.id) or ["up"])
                else:
                    assert chosen == readable[name].choose(board, world.game_settings, snake.id, 1.0)
                asked += 1
        world.step(moves, buffers)
    assert asked > 300


def test_random_safe_rolls_every_safe_move_about_as_often():
    names = [["random_safe", ""]] * 300
    world = BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 2), num_games=300))
    buffers, moves = allocate(world.spec), np.full((300, 2), -1, np.int64)
    world.reset(buffers, 1)
    seats = AnchorSeats(names, world)
    seats.begin(5)
    seats.choose(moves)
    assert (moves[:, 1] == -1).all(), "a seat that is not an anchor's is left alone"
    counts = np.bincount(moves[:, 0], minlength=4)
    assert counts.min() > 45, "four ways are safe from a start square: 75 each, give or take 4 spreads of 7.5"


def test_an_unknown_anchor_is_refused_by_name():
    world = BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 2), num_games=1))
    with pytest.raises(SettingError, match="no anchor 'floodfill'.*flood_fill"):
        AnchorSeats([["floodfill", ""]], world)
