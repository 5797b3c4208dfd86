"""What search keeps between turns: the part of the tree that still holds, the right game's, and thoughts meanwhile."""

import threading
import time

import numpy as np
import pytest
from tests.worlds.battlesnake.players.test_search_position import play

from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.alpha_beta_search import AlphaBetaSearch
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.sessions import SessionCache

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
    tree.simulate(5000)
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
    tree.simulate(300)
    assert tree.visits().sum() == kept + 300
    assert before.turn == after.turn - 1


def test_what_the_moves_do_not_tell_ends_a_tree():
    referee = begun()
    tree = Tree(referee.board, SETTINGS, "s0")
    tree.simulate(2000)
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


def test_every_game_has_its_own_mind():
    minds, games = SessionCache(), [begun(seed) for seed in (1, 2, 3)]
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
    minds = SessionCache(most=2)
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


def test_a_second_core_thinks_about_the_same_position_and_is_heard():
    """Both cores are asked in a duel and among several; what they remember is one table, their trees are two."""
    for snakes in (2, 4):
        settings = GameSettings(11, 11, snakes)
        board = begun(5, settings).board
        for _ in range(100):  # on a busy machine the second thread may not come to think at all
            player = Search(cores=2)
            assert player.choose(board, settings, "s0", 0.3) in MOVES
            (mind,) = player.minds._kept.values()
            helper = mind.helper
            if helper.certainty.found.turns or (helper.tree is not None and helper.tree.size > 1):
                break
        if snakes == 2:
            assert helper.certainty.found.turns > 0
            assert helper.certainty._table is mind.certainty._table
        else:
            assert helper.tree.size > 1
            assert helper.tree is not mind.tree
            assert (helper.tree.visits() != mind.tree.visits()).any(), "it is more curious"
        assert player._is_free.acquire(blocking=False), "the second core is free again"


def test_nobody_waits_for_a_second_core_that_is_busy():
    settings = GameSettings(11, 11, 2)
    board, player = begun(5, settings).board, Search(cores=2)
    with player._is_free:
        assert player.choose(board, settings, "s0", 0.05) in MOVES
    (mind,) = player.minds._kept.values()
    assert mind._helper is None


def test_what_two_threads_wrote_into_one_place_is_not_believed():
    """A torn entry, the key of one position and the value of another, is as good as none."""
    settings = GameSettings(11, 11, 2)
    board = begun(5, settings).board
    plain, torn = AlphaBetaSearch(board, settings, "s0"), AlphaBetaSearch(board, settings, "s0")
    plain.deepen(time.monotonic() + 60, 20_000)
    for _ in range(4):
        torn.deepen(time.monotonic() + 60, torn.found.turns + 2_000)
        torn._table[:, 0] = 999_000  # as if every place held somebody else's certain win
    torn.deepen(time.monotonic() + 60, 20_000)
    assert not torn.found.wins
    assert abs(torn.found.value) < 10_000
