"""What alpha-beta is sure of: equal to looking at everything, and right where a person can tell."""

import time

import pytest
from tests.worlds.battlesnake.players.test_search_position import play

from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.reference import apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext
from racecraft.worlds.battlesnake.players.alpha_beta_search import AlphaBetaSearch
from racecraft.worlds.battlesnake.players.area_control import Lookout
from racecraft.worlds.battlesnake.players.kernels.alpha_beta import DRAWN, PROVEN, WIN
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves
from racecraft.worlds.battlesnake.players.search import Search

SOON = 30.0
"""Seconds that no look here needs."""


def everything(board, settings, me, order, depth):
    """Return the value of a position to snake `me` by looking at every move, under the readable rules."""
    living = [snake.id for snake in board.alive()]
    if me not in living:
        return (DRAWN if not living else -WIN) + board.turn
    if living == [me]:
        return WIN - board.turn
    if depth == 0:
        return opinion(board, settings, me)
    return max(answer(board, settings, me, order, depth, {me: move}) for move in ways(board, settings, me))


def answer(board, settings, me, order, depth, moves):
    """Return what is left of a move when the others, who know it, have answered."""
    waiting = [one for one in order if one not in moves and any(snake.id == one for snake in board.alive())]
    if not waiting:
        after = board.copy()
        apply_rules(find_ruleset(settings.ruleset), after, moves, GameContext(settings))
        after.turn += 1
        return everything(after, settings, me, order, depth - 1)
    replies = ways(board, settings, waiting[0])
    return min(answer(board, settings, me, order, depth, moves | {waiting[0]: move}) for move in replies)


def ways(board, settings, one):
    return safe_moves(board, settings, one) or ["up"]


def opinion(board, settings, me):
    """Appraise with the kernels of `area_control`, not with those of search."""
    lookout = Lookout(board, settings)
    from racecraft.worlds.battlesnake.players.kernels.territory import evaluate

    games = lookout.games
    evaluate(0, games.bodies, games.snakes, games.cells, lookout.params, lookout._scratch, lookout._squares,
             lookout._food_steps, lookout._worths)  # fmt: skip
    number = [snake.id for snake in board.alive()].index(me)
    others = (lookout._worths.sum() - lookout._worths[number]) / (len(board.alive()) - 1)
    return int(10_000 * (lookout._worths[number] - others))


@pytest.mark.parametrize(
    ("players", "depth", "ruleset"), [(2, 3, "standard"), (2, 2, "wrapped"), (2, 2, "constrictor")]
)
def test_cutting_loses_nothing(players, depth, ruleset):
    settings, looked, opinions = GameSettings(7, 7, players, ruleset, minimum_food=2), 0, 0
    for seed in range(4):
        for board, _ in list(play(settings, seed, 40))[2::4]:
            certainty = AlphaBetaSearch(board, settings, "s0")
            found = certainty.deepen(time.monotonic() + SOON, deepest=depth)
            order = [board.alive()[seat].id for seat in certainty._seats]
            expected = everything(board, settings, "s0", order, found.depth)
            assert found.value == pytest.approx(expected, abs=1)
            looked, opinions = looked + 1, opinions + (abs(expected) < PROVEN)
    assert looked > 4
    assert opinions > 2


def test_what_is_remembered_does_not_change_what_is_found():
    settings = GameSettings(7, 7, 2, minimum_food=3)
    boards = [board for board, _ in play(settings, 2, 40)]
    assert len(boards) > 8
    certainty = AlphaBetaSearch(boards[0], settings, "s0")
    for board in boards:
        certainty.set_position(board, settings, "s0")
        found = certainty.deepen(time.monotonic() + SOON, deepest=4)
        fresh = AlphaBetaSearch(board, settings, "s0").deepen(time.monotonic() + SOON, deepest=4)
        assert [value for _, value in found.by_depth] == [value for _, value in fresh.by_depth]


def board_of(*bodies, food=(), healths=(), size=7):
    healths = healths or (100,) * len(bodies)
    snakes = [Snake(f"s{n}", list(body), health) for n, (body, health) in enumerate(zip(bodies, healths, strict=True))]
    return Board(size, size, 5, snakes, list(food))


PLAYERS = [pytest.param(Search(most_walks=4000, sure_among=among), id=name) for name, among in
           (("alpha-beta", 9), ("tree", 0))]  # fmt: skip
BOTH = pytest.mark.parametrize("player", PLAYERS)


def choose(player, board, **settings):
    return player.choose(board, GameSettings(board.width, board.height, len(board.snakes), **settings), "s0", SOON)


@BOTH
def test_an_equal_head_to_head_over_food_is_refused(player):
    """Both heads are one step from the only food; who takes it meets a head as long."""
    board = board_of([(2, 3), (1, 3), (0, 3)], [(4, 3), (5, 3), (6, 3)], food=[(3, 3)])
    assert choose(player, board) != "right"


def test_alpha_beta_takes_the_food_where_it_is_longer():
    board = board_of([(2, 3), (1, 3), (0, 3), (0, 2)], [(4, 3), (5, 3), (6, 3)], food=[(3, 3)])
    assert choose(PLAYERS[0].values[0], board) == "right"


@BOTH
def test_a_forced_win_is_taken(player):
    """The other runs along the wall, walled in by the longer one: one step ahead and it has no way but the corner."""
    mine = [(5, 4), (5, 3), (5, 2), (5, 1), (5, 0), (4, 0), (3, 0)]
    board = board_of(mine, [(6, 3), (6, 2), (6, 1), (6, 0)])
    assert choose(player, board) in ("up", "right")
    found = AlphaBetaSearch(board, GameSettings(7, 7, 2), "s0").deepen(time.monotonic() + SOON)
    assert found.wins
    assert found.move == PLAYERS[0].values[0].choose(board, GameSettings(7, 7, 2), "s0", SOON)


@BOTH
def test_a_pocket_is_seen_before_it_is_entered(player):
    # To the left lies a pocket of three squares that opens in eight turns; to the right half the board.
    body = [(1, 0), (1, 1), (1, 2), (1, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (6, 4)]
    board = board_of(body, [(3, 6), (4, 6), (5, 6)])
    assert choose(player, board) == "right"


@BOTH
def test_a_tail_is_followed_where_nothing_else_is_left(player):
    """A ring that fills a room of four squares: only the square that the tail leaves is open."""
    board = board_of([(0, 0), (0, 1), (1, 1), (1, 0)], [(4, 4), (4, 5), (4, 6)])
    assert choose(player, board) == "right"


@BOTH
@pytest.mark.parametrize(("health", "food"), [(3, [(3, 5)]), (2, [(5, 3)])])
def test_a_starving_snake_goes_straight_to_food(player, health, food):
    board = board_of([(3, 3), (3, 2), (2, 2)], [(6, 0), (6, 1), (5, 1)], food=food, healths=(health, 100))
    assert choose(player, board) == ("up" if food == [(3, 5)] else "right")


def test_hazards_that_kill_on_the_way_are_seen():
    """Straight on lies food behind two hazards that cost more than there is; the way round is longer and free."""
    board = board_of([(3, 1), (3, 0), (2, 0)], [(6, 5), (6, 6), (5, 6)], food=[(3, 4)], healths=(12, 100))
    for square in ((3, 2), (3, 3)):
        board.hazards[square] = 1
    assert choose(PLAYERS[0].values[0], board, ruleset="royale", hazard_damage=9) in ("left", "right")


def test_of_two_ways_to_lose_the_longer_is_taken():
    # Shut in: upward one square, to the left a corridor of three.
    body = [(3, 0), (4, 0), (4, 1), (4, 2), (3, 2), (2, 2), (2, 1), (1, 1), (0, 1), (0, 2), (0, 3), (0, 4), (1, 4)]
    board = board_of(body, [(6, 6), (6, 5), (6, 4)])
    found = AlphaBetaSearch(board, GameSettings(7, 7, 2), "s0").deepen(time.monotonic() + SOON)
    assert found.loses
    assert found.move == "left"


def test_many_looks_fit_into_one_and_stop_on_time():
    settings = GameSettings(11, 11, 4)
    board = next(iter(play(settings, 1, 1)))[0]
    certainty = AlphaBetaSearch(board, settings, "s0")
    certainty.deepen(0.0)
    begin = time.monotonic()
    found = certainty.deepen(begin + 0.1)
    assert 0.09 < time.monotonic() - begin < 5
    assert found.depth >= 2
    assert [depth for depth, _ in enumerate(found.by_depth, 1)][-1] == found.depth


def test_a_first_look_that_is_too_long_is_left_with_a_move():
    """Eight snakes on a board of many words: one turn ahead is thousands of answers."""
    settings = GameSettings(19, 19, 8)
    board = list(play(settings, 3, 5))[-1][0]
    assert len(board.alive()) > 5
    certainty = AlphaBetaSearch(board, settings, board.alive()[0].id)
    certainty.deepen(0.0)
    certainty.set_position(board, settings, board.alive()[0].id)
    begin = time.monotonic()
    found = certainty.deepen(begin)
    assert time.monotonic() - begin < 5
    assert found.move in safe_moves(board, settings, board.alive()[0].id)
