"""By twin: referee and kernel play the same games, roll for roll."""

import numpy as np
import pytest

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.kernels.begin import begin_standard
from racecraft.worlds.battlesnake.env.kernels.rules import play_turn
from racecraft.worlds.battlesnake.env.maps import MAPS
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import allocate_games, food_squares_of, get_board, params_of, put_board


def sorted_food(board):
    board = board.copy()
    board.food.sort(key=lambda point: point[::-1])
    board.hazards = type(board.hazards)({p: n for p, n in board.hazards.items() if n and p[1] < 2 * board.height})
    return board


def sensible_move(board, snake, rng):
    """Mostly a square without a body, sometimes anything: games last, and end in every way."""
    ways = []
    bodies = {point for other in board.alive() for point in other.body[:-1]}
    for number, (dx, dy) in enumerate(((0, 1), (0, -1), (-1, 0), (1, 0))):
        point = (snake.head[0] + dx, snake.head[1] + dy)
        if board.holds(point) and point not in bodies:
            ways.append(number)
    return int(rng.choice(ways)) if ways and rng.random() > 0.03 else int(rng.integers(4))


def play_both(settings, seed, most_turns):
    """Play one game twice; return how many turns it took."""
    rng = np.random.default_rng(seed)
    key = stream_keys(seed, "twins", 1)
    referee = Referee(settings, StreamDice(int(key[0])))
    games, params = allocate_games(settings, 1, key), params_of(settings)
    put_board(games, 0, referee.board, referee.map_state)
    games.chance[0, 1] = referee.dice.counter
    squares = food_squares_of(settings)
    for turn in range(most_turns):
        if referee.over:
            return turn
        ways = [sensible_move(referee.board, snake, rng) for snake in referee.board.snakes]
        names = {snake.id: MOVES[way] for snake, way in zip(referee.board.snakes, ways, strict=True)}
        referee.turn(names)
        play_turn(
            0, np.array([ways], np.int64), games.bodies, games.snakes, games.games, games.cells, games.sides,
            games.events, games.chance, params, squares,
        )  # fmt: skip
        assert get_board(games, 0, settings) == sorted_food(referee.board)
        assert games.chance[0, 1] == referee.dice.counter
    return most_turns


MAZELESS = [name for name in MAPS if name != "solo_maze"]


@pytest.mark.parametrize("ruleset", RULESETS)
def test_referee_and_kernel_play_the_same_games(ruleset):
    solo = ruleset == "solo"
    turns = 0
    for seed in range(6):
        settings = GameSettings(
            width=(7, 11, 13, 19)[seed % 4],
            height=(7, 11, 9, 19)[seed % 4],
            players=1 if solo else (2, 4, 3, 10)[seed % 4],
            ruleset=ruleset,
            food_spawn_chance=(15, 60)[seed % 2],
            minimum_food=(1, 4)[seed % 2],
            shrink_every=(5, 3, 2)[seed % 3],
        )
        turns += play_both(settings, seed, 100)
    assert turns > 60


@pytest.mark.parametrize("name", MAZELESS)
def test_referee_and_kernel_play_the_same_games_on_every_map(name):
    width, height = MAPS[name].sizes[min(2, len(MAPS[name].sizes) - 1)]
    turns = 0
    for seed, ruleset in enumerate(("standard", "royale", "wrapped")):
        settings = GameSettings(
            width, height, 4, ruleset, name, shrink_every=3 + 2 * seed, hazard_damage=(14, 5, -10)[seed]
        )
        turns += play_both(settings, seed, 70)
    assert turns > 10, "the games were long enough to differ"


@pytest.mark.parametrize(("side", "players"), [(7, 2), (7, 5), (11, 4), (11, 8), (19, 8), (8, 4)])
@pytest.mark.parametrize("ruleset", ["standard", "royale", "constrictor"])
def test_the_compiled_set_up_rolls_the_referees_dice(side, players, ruleset):
    settings = GameSettings(side, side, players, ruleset, "hz_columns" if side == 11 else "standard")
    keys = stream_keys(5, "set up", 40)
    games, params = allocate_games(settings, 40, keys), params_of(settings)
    for g in range(40):
        referee = Referee(settings, StreamDice(int(keys[g])))
        start = np.zeros(settings.area, np.int16)
        for (x, y), count in referee.map_state.plan.start.items():
            start[y * side + x] = count
        begin_standard(
            g, games.bodies, games.snakes, games.games, games.cells, games.sides, games.chance, params, start
        )
        assert get_board(games, g, settings) == sorted_food(referee.board)
        assert games.chance[g, 1] == referee.dice.counter
        assert list(games.sides[g, : len(referee.map_state.sides)]) == referee.map_state.sides


@pytest.mark.long
def test_referee_and_kernel_agree_for_a_million_steps():
    turns, seed = 0, 100
    while turns < 1_000_000:
        rng = np.random.default_rng(seed)
        name = MAZELESS[seed % len(MAZELESS)]
        sizes = MAPS[name].sizes
        width, height = sizes[int(rng.integers(len(sizes)))]
        ruleset = list(RULESETS)[seed // 7 % 6]
        settings = GameSettings(
            width,
            height,
            1 if ruleset == "solo" else int(rng.integers(2, min(MAPS[name].most_players, 8) + 1)),
            ruleset,
            name,
            food_spawn_chance=int(rng.integers(0, 101)),
            minimum_food=int(rng.integers(0, 6)),
            hazard_damage=int(rng.integers(-30, 60)),
            shrink_every=int(rng.integers(1, 30)),
        )
        turns += play_both(settings, seed, 1500)
        seed += 1
