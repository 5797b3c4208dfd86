"""The position that search plays forward: held equal to the compiled rules, and its water to water poured by hand."""

import itertools

import numpy as np
import pytest
from tests.reference import DATA

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import MOVES, Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.kernels.rules import apply_rules
from racecraft.worlds.battlesnake.env.records import read_games
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import default_move
from racecraft.worlds.battlesnake.players.area_control import position_arrays
from racecraft.worlds.battlesnake.players.kernels.fill import MEAL_STEPS, SQUARES, claim
from racecraft.worlds.battlesnake.players.kernels.position import advance, is_over, safe_ways
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves, square_after
from racecraft.worlds.battlesnake.players.search_position import board_at, fill_buffers, position_of

SIZES = [(11, 11, 2), (7, 7, 3), (13, 9, 4), (19, 19, 8), (16, 8, 2)]


def play(settings, seed, turns):
    """Yield positions of a game of mostly sensible moves, with the moves made there."""
    rng, referee = np.random.default_rng(seed), Referee(settings, StreamDice(int(stream_keys(seed, "search", 1)[0])))
    for _ in range(turns):
        if referee.over:
            return
        board, moves = referee.board, {}
        for snake in board.alive():
            safe = safe_moves(board, settings, snake.id)
            moves[snake.id] = str(rng.choice(safe if safe and rng.random() > 0.05 else MOVES))
        yield board, moves
        referee.turn(moves)


def turn_by_kernel(board, settings, moves):
    """Return who lives after a turn of the compiled rules, and where; the map does nothing."""
    from racecraft.worlds.battlesnake.env.state import get_board

    games, params = position_arrays(board, settings, copies=1)
    ids = [snake.id for snake in board.alive()]
    ways = np.array([[MOVES.index(moves[one]) for one in ids]], np.int64)
    apply_rules(0, ways, games.bodies, games.snakes, games.games, games.cells, games.sides, params)
    after = get_board(games, 0, GameSettings(board.width, board.height, len(ids)), ids)
    return [(snake.id, snake.body, snake.health) for snake in after.alive()], sorted(after.food)


def turn_by_search(board, settings, moves):
    position = position_of(board, settings)
    ways = np.zeros((1, len(board.alive())), np.int64)
    ways[0] = [MOVES.index(moves[snake.id]) for snake in board.alive()]
    advance(0, ways, *position[:4], position.rules)
    after = board_at(position, 1, board)
    return [(snake.id, snake.body, snake.health) for snake in after.snakes], sorted(after.food)


@pytest.mark.parametrize("ruleset", RULESETS)
def test_a_turn_is_that_of_the_compiled_rules(ruleset):
    turns, died, ate = 0, 0, 0
    for seed in range(20):
        width, height, players = SIZES[seed % len(SIZES)]
        players = 1 if ruleset == "solo" else players
        settings = GameSettings(width, height, players, ruleset, food_spawn_chance=60, minimum_food=6, shrink_every=4)
        for board, moves in play(settings, seed, 120):
            found = turn_by_search(board, settings, moves)
            assert found == turn_by_kernel(board, settings, moves)
            turns, died = turns + 1, died + len(board.alive()) - len(found[0])
            ate += len(board.food) - len(found[1])
    assert turns > 250
    assert died > 5
    assert ate > 5


@pytest.mark.parametrize("which", ["", "_more"])
def test_a_turn_is_that_of_the_official_engine(which):
    """Every turn of every third recorded game: who lives after it, where, how healthy, and which food is left."""
    turns, died = 0, 0
    games = read_games(DATA / "battlesnake" / f"official_engine_trajectories{which}.jsonl.gz")
    for game in itertools.islice(games, 0, None, 3):
        for step in game.steps:
            words = {one.id: default_move(one.body, *game_size(game)) for one in step.before.alive()}
            moves = {one: step.moves.get(one, "") for one in words}
            moves = {one: word if word in MOVES else words[one] for one, word in moves.items()}
            living, food = turn_by_search(step.before, game.settings, moves)
            after = step.after_rules
            assert living == [(snake.id, snake.body, snake.health) for snake in after.alive()]
            assert food == sorted(after.food)
            turns, died = turns + 1, died + len(step.before.alive()) - len(living)
    assert turns > 600
    assert died > 10


def game_size(game):
    return game.settings.width, game.settings.height


def test_a_line_of_turns_comes_back_as_it_was():
    """Sister moves share the ring: what a deep line wrote must not show in another."""
    settings = GameSettings(11, 11, 2, minimum_food=8)
    for board, _ in list(play(settings, 5, 60))[20:40:5]:
        position, rng = position_of(board, settings), np.random.default_rng(1)
        ways = np.zeros((12, len(board.alive())), np.int64)

        def line(depth=12, position=position, ways=ways):
            d = 0
            while d < depth and not is_over(d, position.rows, position.rules):
                advance(d, ways, *position[:4], position.rules)
                d += 1
            return d

        ways[:] = rng.integers(0, 4, ways.shape)
        for d in range(12):
            for s in range(ways.shape[1]):
                if position.rows[d, s, 5] == 0:
                    safe = safe_ways(d, s, *position[:4], position.rules)
                    ways[d, s] = next((way for way in range(4) if safe >> way & 1), 0)
            if is_over(d, position.rows, position.rules):
                break
            advance(d, ways, *position[:4], position.rules)
        first = ways.copy()
        depth = line()
        expected = board_at(position, depth, board)
        for _ in range(20):
            ways[:] = rng.integers(0, 4, ways.shape)
            line()
        ways[:] = first
        assert line() == depth
        assert board_at(position, depth, board) == expected


@pytest.mark.parametrize("ruleset", ["standard", "wrapped", "royale"])
def test_safe_ways_are_those_of_the_readable_page(ruleset):
    for seed, (width, height, players) in enumerate(SIZES):
        settings = GameSettings(width, height, players, ruleset, shrink_every=3, hazard_damage=60)
        for board, _ in play(settings, seed, 60):
            position = position_of(board, settings)
            for number, snake in enumerate(board.alive()):
                bits = safe_ways(0, number, *position[:4], position.rules)
                assert [MOVES[way] for way in range(4) if bits >> way & 1] == safe_moves(board, settings, snake.id)


def poured(board, settings):
    """Return squares and food steps of every living snake, by sets of squares and the law in words."""
    living = board.alive()
    opens = {}
    for snake in living:
        for place, square in enumerate(snake.body):
            opens[square] = max(opens.get(square, 0), len(snake.body) - place)
    fronts = [{snake.head} for snake in living]
    taken, own, meals = {snake.head for snake in living}, [0] * len(living), [board.width * board.height] * len(living)
    step = 0
    while any(fronts):
        step += 1
        fresh = []
        for front in fronts:
            near = {square_after(square, move, board, settings) for square in front for move in MOVES}
            fresh.append({n for n in near if board.holds(n) and n not in taken and opens.get(n, 0) <= step})
        for number, snake in enumerate(living):
            rivals = [o for o in range(len(living)) if o != number and len(living[o].body) >= len(snake.body)]
            fronts[number] = {n for n in fresh[number] if not any(n in fresh[o] for o in rivals)}
            own[number] += len(fronts[number])
            if fronts[number] & set(board.food):
                meals[number] = min(meals[number], step)
        taken.update(*fresh)
    return own, meals


@pytest.mark.parametrize("ruleset", ["standard", "wrapped", "constrictor"])
def test_water_is_poured_as_by_hand(ruleset):
    looked = 0
    for seed, (width, height, players) in enumerate([*SIZES, (3, 3, 2), (8, 8, 2), (9, 8, 2), (25, 25, 4)]):
        settings = GameSettings(width, height, players, ruleset, minimum_food=3)
        for board, _ in list(play(settings, seed, 80))[::4]:
            position = position_of(board, settings)
            pools, found = fill_buffers(position)
            claim(0, *position[:3], position.edges, position.rules, pools, found)
            own, meals = poured(board, settings)
            assert found[:, SQUARES].tolist() == own
            assert found[:, MEAL_STEPS].tolist() == meals
            looked += 1
    assert looked > 30


def test_a_position_that_cannot_be_told_is_refused():
    for bodies in (
        [[(1, 1), (1, 2), (1, 1)]],
        [[(1, 1), (1, 2)], [(1, 2), (2, 2)]],
        [[(9, 9), (9, 8)]],
    ):
        snakes = [Snake(str(number), body) for number, body in enumerate(bodies)]
        with pytest.raises(BoardError, match="off the board"):
            position_of(Board(7, 7, snakes=snakes), GameSettings(7, 7, len(bodies)))
