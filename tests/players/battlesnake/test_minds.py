"""What search keeps between turns: the part of the tree that still holds, the right game's, and thoughts meanwhile."""

import threading
import time

import numpy as np
import pytest
from tests.players.battlesnake.test_search_position import play

from racecraft.envs.battlesnake.board import MOVES
from racecraft.envs.battlesnake.dice import StreamDice
from racecraft.envs.battlesnake.reference import Referee
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.players.battlesnake.minds import Minds
from racecraft.players.battlesnake.protocol import PlayerError
from racecraft.players.battlesnake.search import Search
from racecraft.players.battlesnake.sight import best_safe_move
from racecraft.players.battlesnake.tree import Tree

SETTINGS = GameSettings(11, 11, 3, food_spawn_chance=0, minimum_food=0)


def begun(seed=1, settings=SETTINGS):
    """Return a game some turns old."""
    referee = Referee(settings, StreamDice(seed))
    for move in ("up", "up", "left"):
        referee.turn({snake.id: move if snake.head[1] < 8 else "down" for snake in referee.board.alive()})
    assert len(referee.board.alive()) == settings.players
    return referee


def safely_on(referee):
    """Play a turn that nobody dies of."""
    board = referee.board
    return referee.turn({snake.id: best_safe_move(board, referee.settings, snake.id) for snake in board.alive()})


def favourites(tree):
    """Return every snake's most walked move."""
    return {f"s{s}": MOVES[way] for s, way in enumerate(np.argmax(tree._nodes[2][0], axis=1))}


def test_the_tree_below_the_moves_that_were_made_is_kept():
    referee = begun()
    tree = Tree(referee.board, SETTINGS, "s0")
    tree.walk(5000)
    before = referee.board
    after = referee.turn(favourites(tree))
    whole = tree.size
    assert tree.follow(after, SETTINGS)
    kept = int(tree.visits().sum())
    assert 100 < kept < 5000
    assert tree.size < whole
    fresh = Tree(after, SETTINGS, "s0")
    assert tree._nodes[5][0] == pytest.approx(fresh._nodes[5][0]), "it is this position that it begins with"
    assert (tree.priors() == fresh.priors()).all()
    tree.walk(300)
    assert tree.visits().sum() == kept + 300
    assert before.turn == after.turn - 1


def test_what_the_moves_do_not_tell_ends_a_tree():
    referee = begun()
    tree = Tree(referee.board, SETTINGS, "s0")
    tree.walk(2000)
    moves = favourites(tree)
    after = referee.turn(moves)
    for spoil in (
        lambda board: board.food.append((5, 0)),
        lambda board: board.hazards.update({(5, 0): 1}),
        lambda board: setattr(board.snakes[1], "health", 40),
        lambda board: board.snakes.pop(),
        lambda board: setattr(board, "turn", board.turn + 1),
    ):
        other = after.copy()
        spoil(other)
        assert not tree.follow(other, SETTINGS)
    assert tree.follow(after, SETTINGS)


def test_a_moves_statistics_are_those_of_the_subtree():
    """What a transplanted node knows of its children is what it knew before."""
    referee = begun(2)
    tree = Tree(referee.board, SETTINGS, "s0")
    tree.walk(3000)
    moves = favourites(tree)
    joint = 0
    for one in ("s0", "s1", "s2"):
        joint = joint * 4 + MOVES.index(moves[one])
    links, joints, visits, sums = tree._nodes[:4]
    child = links[0, 0]
    while joints[child] != joint:
        child = links[child, 1]
    told = visits[child].copy(), sums[child].copy()
    assert tree.follow(referee.turn(moves), SETTINGS)
    assert (tree._nodes[2][0] == told[0]).all()
    assert (tree._nodes[3][0] == told[1]).all()


def test_every_game_has_its_own_mind():
    minds, games = Minds(), [begun(seed) for seed in (1, 2, 3)]
    firsts = [minds.recall(game.board, SETTINGS, "s0") for game in games]
    for mind in firsts:
        minds.keep(mind, "up")
    for game in games:
        safely_on(game)
    for game, mind in zip(games, firsts, strict=True):
        assert minds.recall(game.board, SETTINGS, "s0") is mind
        minds.keep(mind, "up")
    assert minds.recall(games[0].board, SETTINGS, "s0") is not firsts[0], "the same turn again is no next turn"


def test_only_so_many_games_are_remembered():
    minds = Minds(most=2)
    for seed in (1, 2, 3):
        minds.keep(minds.recall(begun(seed).board, SETTINGS, "s0"), "up")
    assert len(minds._kept) == 2


@pytest.mark.parametrize("players", [2, 3])
def test_it_thinks_on_while_nobody_asks_and_stops_when_somebody_does(players):
    settings = GameSettings(11, 11, players, food_spawn_chance=0, minimum_food=0)
    referee, player = begun(1, settings), Search(ponders=True)
    player.choose(referee.board, settings, "s0", 0.02)
    (mind,) = player.minds._kept.values()
    known = mind.tree.size if mind.tree else mind.certainty.found.turns
    until = time.monotonic() + 60
    while (mind.tree.size if mind.tree else mind.certainty.found.turns) <= known and time.monotonic() < until:
        time.sleep(0.01)
    assert (mind.tree.size if mind.tree else mind.certainty.found.turns) > known
    begin = time.monotonic()
    player.choose(safely_on(referee), settings, "s0", 0.0)
    assert time.monotonic() - begin < 5
    player.minds.ponders = False
    player.choose(referee.board, settings, "s0", 0.0)
    assert not player.minds._pondered


def test_nobody_ponders_unasked():
    before = threading.active_count()
    Search().choose(begun().board, SETTINGS, "s0", 0.01)
    assert threading.active_count() == before


def test_a_game_is_played_through_with_what_was_kept():
    settings, player = GameSettings(7, 7, 2), Search()
    for board, _ in play(settings, 4, 30):
        for snake in board.alive():
            assert player.choose(board, settings, snake.id, 0.005) in MOVES
    with pytest.raises(PlayerError):
        player.choose(board, settings, "nobody", 0.01)
