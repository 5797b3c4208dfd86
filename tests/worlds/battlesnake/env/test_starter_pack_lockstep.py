"""By twin: our gym and the starter pack's own, turn by turn; and by hand, one quirk each.

Where RACECRAFT_STARTER_PACK names the folder `source/BattlesnakeGym` of an unpacked copy of the original, both play
(starter_pack_games.py). Elsewhere ours is held to what the original answered, kept as a digest of each game.
"""

import json
import os
import types
from pathlib import Path

import pytest
from tests.worlds.battlesnake.env import starter_pack_games
from tests.worlds.battlesnake.env.starter_pack_games import BOARDS, DISTINCT, HEALTHS

from racecraft.worlds.battlesnake.env.starter_pack import OBSERVATION_TYPES, StarterPackGym

UP, DOWN, LEFT, RIGHT = range(4)
ANSWERS = json.loads(starter_pack_games.ANSWERS.read_text())


@pytest.fixture(scope="module")
def pack():
    """The original's module, where there is one."""
    folder = Path(os.environ.get("RACECRAFT_STARTER_PACK", "nowhere"))
    return starter_pack_games.original(folder) if (folder / "battlesnake_gym").is_dir() else None


@pytest.mark.parametrize(("size", "snakes"), BOARDS)
@pytest.mark.parametrize("observation", OBSERVATION_TYPES)
def test_every_turn_is_the_originals(pack, size, snakes, observation):
    fates = []
    told = list(starter_pack_games.games(size, snakes, observation, pack, fates))
    assert told == ANSWERS[f"{size} {snakes} {observation}"]
    assert len(fates) > 200, "one for each snake and turn"
    assert len(set(fates)) >= {1: 4, 2: 6, 3: 6}.get(snakes, 8), set(fates)


@pytest.mark.parametrize("health", HEALTHS)
def test_a_given_state_is_read_and_played_as_the_original_does(pack, health):
    assert list(starter_pack_games.given_games(health, pack)) == ANSWERS[f"given {health}"]


# By hand: some quirks, one each. Squares are (row, column).


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


def test_who_dies_this_turn_still_kills_in_it():
    """0 and 1 are equal and meet on (3, 3); 2 runs into 1's body, and dies of it though 1 dies, too."""
    gym = game_of([(3, 2), (3, 1)], [(3, 4), (3, 5)], [(2, 4), (1, 4), (0, 4)], FAR)
    _, rewards, dones, info = gym.step([RIGHT, LEFT, DOWN, UP])
    assert dones == {0: True, 1: True, 2: True, 3: False}
    assert info["snake_info"][2] == "Snake hit body - hit other"
    assert rewards[0] == rewards[1] == paid("was_eaten", "died")
    assert rewards[2] == paid("hit_other_snake", "died")
    assert rewards[3] == paid("another_turn", "won")


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
