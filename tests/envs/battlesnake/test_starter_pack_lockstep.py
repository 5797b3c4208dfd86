"""By twin: our gym and the starter pack's own, turn by turn; and by hand, where no copy of the pack is at hand.

The pack is `source/BattlesnakeGym` of the archived repository awslabs/sagemaker-battlesnake-ai (Apache-2.0), unpacked
anywhere; the variable RACECRAFT_STARTER_PACK names that folder. Its chance is replaced by ours, so both play one game.
"""

import os
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from racecraft.envs.battlesnake.starter_pack import OBSERVATION_TYPES, Rewards, StarterPackGym

UP, DOWN, LEFT, RIGHT = range(4)
KEYS = tuple(Rewards.__dataclass_fields__)
DISTINCT = {key: 2.0**n for n, key in enumerate(KEYS)}
"""Prices whose sum tells which were paid."""


class Dice:
    """One stream of chance for both: whether a food falls, and which of the free squares it takes."""

    def __init__(self, rng):
        self.rng, self.falls, self.place = rng, False, 0.0

    def shake(self):
        self.falls, self.place = bool(self.rng.random() < 0.5), float(self.rng.random())

    def random(self):
        return 0.0 if self.falls else 0.99

    def integers(self, count):
        return int(self.place * count)

    def coordinates(self, size, count, excluding=()):
        taken = {(int(row), int(column)) for row, column in excluding}
        free = [(r, c) for r in range(size[0]) for c in range(size[1]) if (r, c) not in taken]
        return [free[self.integers(len(free))]]


@pytest.fixture(scope="module")
def pack():
    """The original's module; its ancient `gym` is stood in for, as nothing of it is used but names."""
    folder = os.environ.get("RACECRAFT_STARTER_PACK")
    if not folder or not (Path(folder) / "battlesnake_gym" / "snake_gym.py").is_file():
        pytest.skip("RACECRAFT_STARTER_PACK does not name an unpacked copy of the starter pack's source/BattlesnakeGym")
    gym, spaces = types.ModuleType("gym"), types.ModuleType("gym.spaces")
    utils, seeding = types.ModuleType("gym.utils"), types.ModuleType("gym.utils.seeding")

    class Space:
        def __init__(self, *_, **__):
            pass

    gym.Env, gym.spaces, gym.utils, utils.seeding = object, spaces, utils, seeding
    spaces.space = types.SimpleNamespace(Space=Space)
    spaces.Box = spaces.Discrete = Space
    stand_ins = {"gym": gym, "gym.spaces": spaces, "gym.utils": utils, "gym.utils.seeding": seeding}
    with pytest.MonkeyPatch.context() as patch:
        for name, module in stand_ins.items():
            patch.setitem(sys.modules, name, module)
        patch.syspath_prepend(folder)
        yield __import__("battlesnake_gym.snake_gym", fromlist=["snake_gym"])


def both(pack, monkeypatch, rng, **options):
    dice = Dice(rng)
    food = sys.modules["battlesnake_gym.food"]
    monkeypatch.setattr(food, "random", dice)
    monkeypatch.setattr(food, "get_random_coordinates", dice.coordinates)
    rewards = pack.SimpleRewards()
    rewards.reward_dict = DISTINCT
    theirs = pack.BattlesnakeGym(**options, rewards=rewards)
    ours = StarterPackGym(**options, rewards=rewards)
    ours._rng = dice
    return ours, theirs, dice


def same(ours, theirs, where):
    for name, a, b in zip(("state", "rewards", "dones", "info"), ours, theirs, strict=True):
        if name == "state":
            assert a.dtype == b.dtype, where
            assert a.shape == b.shape, where
            assert np.array_equal(a, b), f"{where}: state\n{np.argwhere(a != b)}"
        else:
            assert a == b, f"{where}: {name}"


def choose(gym, rng, boldness):
    """Mostly moves that stay on the board and off bodies, so that games last; the rest is any move."""
    taken = {square for snake in gym.snakes for square in snake.body}
    rows, columns = gym.map_size
    moves = []
    for snake in gym.snakes:
        head = snake.body[0] if snake.alive else (-9, -9)
        around = [(head[0] + row, head[1] + column) for row, column in ((-1, 0), (1, 0), (0, -1), (0, 1))]
        safe = [a for a, s in enumerate(around) if s not in taken and 0 <= s[0] < rows and 0 <= s[1] < columns]
        moves.append(int(rng.choice(safe)) if safe and rng.random() > boldness else int(rng.integers(4)))
    return moves


@pytest.mark.parametrize(
    ("size", "snakes"), [((5, 5), 1), ((5, 5), 4), ((7, 7), 2), ((7, 7), 6), ((7, 9), 3), ((11, 11), 5)]
)
@pytest.mark.parametrize("observation", OBSERVATION_TYPES)
def test_every_turn_is_the_originals(pack, monkeypatch, size, snakes, observation):
    rng = np.random.default_rng([*size, snakes, OBSERVATION_TYPES.index(observation)])
    fates, steps = set(), 0
    for game in range(30):
        cells = rng.choice(size[0] * size[1], snakes, replace=False)
        spawns = [(int(cell) // size[1], int(cell) % size[1]) for cell in cells]
        ours, theirs, dice = both(
            pack, monkeypatch, rng, observation_type=observation, map_size=size, number_of_snakes=snakes,
            snake_spawn_locations=spawns,
        )  # fmt: skip
        dice.shake()
        same(ours.reset(), theirs.reset(), f"game {game}, reset")
        for turn in range(150):
            dice.shake()
            moves = choose(ours, rng, rng.choice([0.02, 0.2]))
            found = ours.step(moves, episodes=game)
            same(found, theirs.step(moves, game), f"game {game}, turn {turn}, {moves}")
            fates |= set(found[3]["snake_info"].values())
            steps += 1
            if not any(snake.alive for snake in ours.snakes) or (snakes > 1 and ours.over and rng.random() < 0.5):
                break  # the other half of the games is played on after its end
    assert steps > 200
    assert len(fates) >= {1: 4, 2: 6, 3: 6}.get(snakes, 8), fates


@pytest.mark.parametrize("health", [1, 2, 100])
def test_a_given_state_is_read_and_played_as_the_original_does(pack, monkeypatch, health):
    rng = np.random.default_rng(health)
    bodies = [[(1, 1)] * 3, [(5, 5), (5, 4), (4, 4), (3, 4)], [(2, 5), (2, 6)], [(0, 6)]]
    snakes = [{"health": health + n, "body": [{"x": x, "y": y} for x, y in body]} for n, body in enumerate(bodies)]
    start = {"turn": 9, "board": {"height": 7, "width": 7, "food": [{"x": 3, "y": 1}], "snakes": snakes}}
    for game in range(25):
        ours, theirs, dice = both(
            pack, monkeypatch, rng, map_size=(7, 7), number_of_snakes=4, initial_game_state=start,
            observation_type="bordered-num",
        )  # fmt: skip
        same(ours.reset(), theirs.reset(), f"game {game}, reset")
        for turn in range(40):
            dice.shake()
            moves = choose(ours, rng, 0.1)
            same(ours.step(moves), theirs.step(moves), f"game {game}, turn {turn}, {moves}")


# By hand: the same quirks, one each, where no copy of the original is at hand. Squares are (row, column).


def game_of(*bodies, food=(), side=7, **options):
    """A gym at a state; bodies are squares (row, column) from head to tail."""

    def points(squares):
        return [{"x": column, "y": row} for row, column in squares]

    snakes = [{"id": str(n), "health": 90, "body": points(body)} for n, body in enumerate(bodies)]
    start = {"turn": 0, "board": {"height": side, "width": side, "food": points(food), "snakes": snakes}}
    gym = StarterPackGym("flat-num", (side, side), rewards=DISTINCT, initial_game_state=start, **options)
    gym.reset()
    gym._rng = types.SimpleNamespace(random=lambda: 0.99)  # no food falls
    for snake in gym.snakes:
        snake.stacked = 0
    return gym


def paid(*keys):
    return sum(DISTINCT[key] for key in keys)


FAR = [(6, 0), (6, 1)]


def test_a_meal_shows_one_turn_later():
    gym = game_of([(3, 3), (3, 2)], FAR, food=[(3, 4)])
    assert gym.step([RIGHT, UP])[1][0] == paid("ate_food", "another_turn")
    assert gym.snakes[0].body == [(3, 4), (3, 3)], "still two long: the tail moved before the meal"
    gym.step([RIGHT, UP])
    assert gym.snakes[0].body == [(3, 5), (3, 4), (3, 3)]


def test_a_snake_of_any_length_keeps_its_tail_on_its_first_two_moves():
    gym = game_of([(3, 3), (3, 2), (3, 1), (3, 0)], FAR)
    gym.snakes[0].stacked = 2
    for length in (5, 6, 6):
        gym.step([RIGHT, UP])
        assert len(gym.snakes[0].body) == length


def test_who_dies_this_turn_still_kills_in_it():
    """0 and 1 are equal and meet on (3, 3); 2 runs into 1's body, and dies of it though 1 dies, too."""
    gym = game_of([(3, 2), (3, 1)], [(3, 4), (3, 5)], [(2, 4), (1, 4), (0, 4)], FAR)
    _, rewards, dones, info = gym.step([RIGHT, LEFT, DOWN, UP])
    assert dones == {0: True, 1: True, 2: True, 3: False}
    assert info["snake_info"][2] == "Snake hit body - hit other"
    assert rewards[0] == rewards[1] == paid("was_eaten", "died")
    assert rewards[2] == paid("hit_other_snake", "died")
    assert rewards[3] == paid("another_turn", "won")


def test_who_leaves_the_board_blocks_nobody():
    """1 goes over the right edge; 0 enters the square that 1's body still holds, and lives."""
    gym = game_of([(2, 6), (1, 6)], [(3, 6), (4, 6), (5, 6)], FAR)
    _, rewards, dones, _ = gym.step([DOWN, RIGHT, UP])
    assert dones == {0: False, 1: True, 2: False}
    assert rewards[0] == paid("another_turn")
    assert rewards[1] == paid("hit_wall")


def test_a_body_that_was_hit_pays_only_for_a_rival_not_yet_doomed():
    """1 runs into 0's body. 0 is looked at first and is paid; with the seats swapped it is not."""
    long, short = [(3, 4), (3, 3), (3, 2), (3, 1)], [(2, 2), (1, 2)]
    first = game_of(long, short, FAR).step([RIGHT, DOWN, UP])[1]
    assert first[0] == paid("other_snake_hit_body", "another_turn")
    second = game_of(short, long, FAR).step([DOWN, RIGHT, UP])[1]
    assert second[1] == paid("another_turn")


def test_a_solo_game_is_never_over_and_never_pays_its_end():
    gym = game_of([(0, 3), (1, 3)])
    _, rewards, dones, _ = gym.step([UP])
    assert dones == {0: True}
    assert rewards == {0: paid("hit_wall")}
    assert gym.step([UP])[1] == {0: 0}


def test_equal_heads_leave_the_food_and_both_pay_for_it():
    gym = game_of([(3, 2), (3, 1)], [(3, 4), (3, 5)], food=[(3, 3)])
    _, rewards, dones, info = gym.step([RIGHT, LEFT])
    assert dones == {0: True, 1: True}
    assert gym.food == {(3, 3)}
    assert rewards == {0: paid("was_eaten", "died"), 1: paid("was_eaten", "died")}
    assert info["snake_info"][0] == "Snake was eaten - same tile"


def test_a_board_that_is_no_square_is_padded_by_its_rows_alone():
    assert StarterPackGym("max-bordered-51s", (7, 9), 2).reset()[0].shape == (21, 23, 3)
    state = StarterPackGym("max-bordered-51s", (7, 9), 2).reset()[0]
    assert (state[7:14, 7:16] >= 0).all()
    assert (state[:7] == -1).all()
    assert (state[:, 16:] == -1).all()


def test_rewards_of_ones_own_are_asked_by_name_snake_and_episode():
    class Mine:
        def __init__(self):
            self.asked = []

        def get_reward(self, name, snake_id, episode):
            self.asked.append((name, snake_id, episode))
            return 10 * (snake_id + 1)

    mine = Mine()
    gym = StarterPackGym("flat-51s", (7, 7), 2, [(0, 3), (3, 3)], rewards=mine)
    gym.reset()
    rewards = gym.step([UP, UP], episodes=77)[1]
    assert rewards == {0: 10 + 10, 1: 20 + 20}
    assert set(mine.asked) == {("hit_wall", 0, 77), ("died", 0, 77), ("another_turn", 1, 77), ("won", 1, 77)}
