"""Games that our gym and the starter pack's own both play: one chance, one choice of moves, and what each answered.

The pack is `source/BattlesnakeGym` of the archived repository awslabs/sagemaker-battlesnake-ai (Apache-2.0), unpacked
anywhere. Its chance is replaced by ours, so both play one game. What it answered is kept as one digest a game in
starter_pack_answers.json, written anew by

    python tests/worlds/battlesnake/env/starter_pack_games.py FOLDER

All chance is `random.Random.random`, whose numbers are the same in every version of Python.
"""

import hashlib
import json
import random
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

from racecraft.worlds.battlesnake.env.starter_pack import OBSERVATION_TYPES, Rewards, StarterPackGym

ANSWERS = Path(__file__).with_name("starter_pack_answers.json")
KEYS = tuple(Rewards.__dataclass_fields__)
DISTINCT = {key: 2.0**n for n, key in enumerate(KEYS)}
"""Prices whose sum tells which were paid."""
BOARDS = (((5, 5), 1), ((5, 5), 4), ((7, 7), 2), ((7, 7), 6), ((7, 9), 3), ((11, 11), 5))
HEALTHS = (1, 2, 100)


class Chance:
    """What games are played with."""

    def __init__(self, seed):
        self._random = random.Random(seed).random

    def under(self, share):
        return self._random() < share

    def below(self, count):
        return int(self._random() * count)

    def one_of(self, things):
        return things[self.below(len(things))]

    def some_of(self, count, of):
        """Return `count` different numbers below `of`."""
        numbers = list(range(of))
        return [numbers.pop(self.below(len(numbers))) for _ in range(count)]


class Dice:
    """One stream of chance for both gyms: whether a food falls, and which of the free squares it takes."""

    def __init__(self, chance):
        self.chance, self.falls, self.place = chance, False, 0.0

    def shake(self):
        self.falls, self.place = self.chance.under(0.5), self.chance._random()

    def random(self):
        return 0.0 if self.falls else 0.99

    def integers(self, count):
        return int(self.place * count)

    def coordinates(self, size, count, excluding=()):
        taken = {(int(row), int(column)) for row, column in excluding}
        free = [(r, c) for r in range(size[0]) for c in range(size[1]) if (r, c) not in taken]
        return [free[self.integers(len(free))]]


def original(folder):
    """Return the original's module; its ancient `gym` is stood in for, as nothing of it is used but names."""
    gym, spaces = types.ModuleType("gym"), types.ModuleType("gym.spaces")
    utils, seeding = types.ModuleType("gym.utils"), types.ModuleType("gym.utils.seeding")

    class Space:
        def __init__(self, *_, **__):
            pass

    gym.Env, gym.spaces, gym.utils, utils.seeding = object, spaces, utils, seeding
    spaces.space = types.SimpleNamespace(Space=Space)
    spaces.Box = spaces.Discrete = Space
    stand_ins = {"gym": gym, "gym.spaces": spaces, "gym.utils": utils, "gym.utils.seeding": seeding}
    with mock.patch.dict(sys.modules, stand_ins), mock.patch.object(sys, "path", [str(folder), *sys.path]):
        module = __import__("battlesnake_gym.snake_gym", fromlist=["snake_gym"])
        module.food = sys.modules["battlesnake_gym.food"]
        return module


class Both:
    """Our gym, and beside it the original's where there is one; what they answer must be the same."""

    def __init__(self, pack, dice, **options):
        self.ours, self.theirs = StarterPackGym(**options, rewards=Prices()), None
        self.ours._rng = dice
        if pack is not None:
            pack.food.random, pack.food.get_random_coordinates = dice, dice.coordinates
            self.theirs = pack.BattlesnakeGym(**options, rewards=Prices())
        self.digest = hashlib.sha256()

    def reset(self, where):
        self._heard(self.ours.reset(), self.theirs and self.theirs.reset(), where)

    def step(self, moves, game, where):
        found = self.ours.step(moves, episodes=game)
        self._heard(found, self.theirs and self.theirs.step(moves, game), where)
        return found

    def _heard(self, ours, theirs, where):
        told = told_of(ours)
        if theirs is not None:
            for name, a, b in zip(("state", "rewards", "dones", "info"), told, told_of(theirs), strict=True):
                assert a == b, f"{where}: {name}\n{ours}\n{theirs}"
        for part in told:
            self.digest.update(part)


class Prices:
    """What both gyms pay."""

    def get_reward(self, name, snake_id, episode):
        return DISTINCT[name]


def told_of(answer):
    """Return a gym's answer as bytes: the state with its type and shape, then rewards, dones and what else it says."""
    state, *rest = answer
    head = f"{state.dtype.str}{state.shape}".encode()
    return [head + np.ascontiguousarray(state).tobytes(), *(json.dumps(_plain(part)).encode() for part in rest)]


def _plain(value):
    """Return what is equal by `==` in one form: dictionaries in order, numbers as floats."""
    if isinstance(value, dict):
        return [[_plain(key), _plain(value[key])] for key in sorted(value)]
    if isinstance(value, str | bool | np.bool_ | None):
        return value if isinstance(value, str) else repr(value)
    return float(value)


def choose(gym, chance, boldness):
    """Mostly moves that stay on the board and off bodies, so that games last; the rest is any move."""
    taken = {square for snake in gym.snakes for square in snake.body}
    rows, columns = gym.map_size
    moves = []
    for snake in gym.snakes:
        head = snake.body[0] if snake.alive else (-9, -9)
        around = [(head[0] + row, head[1] + column) for row, column in ((-1, 0), (1, 0), (0, -1), (0, 1))]
        safe = [a for a, s in enumerate(around) if s not in taken and 0 <= s[0] < rows and 0 <= s[1] < columns]
        moves.append(chance.one_of(safe) if safe and not chance.under(boldness) else chance.below(4))
    return moves


def games(size, snakes, observation, pack=None, fates=None) -> Iterator[str]:
    """Play 30 games from random places and yield a digest of each; `fates` collects what became of snakes."""
    chance = Chance(f"{size} {snakes} {observation}")
    for game in range(30):
        cells = chance.some_of(snakes, of=size[0] * size[1])
        spawns = [(cell // size[1], cell % size[1]) for cell in cells]
        dice = Dice(chance)
        dice.shake()
        both = Both(
            pack, dice, observation_type=observation, map_size=size, number_of_snakes=snakes,
            snake_spawn_locations=spawns,
        )  # fmt: skip
        both.reset(f"game {game}, reset")
        for turn in range(150):
            dice.shake()
            moves = choose(both.ours, chance, chance.one_of([0.02, 0.2]))
            found = both.step(moves, game, f"game {game}, turn {turn}, {moves}")
            if fates is not None:
                fates += found[3]["snake_info"].values()
            if not any(snake.alive for snake in both.ours.snakes) or (
                snakes > 1 and both.ours.over and chance.under(0.5)
            ):
                break  # the other half of the games is played on after its end
        yield both.digest.hexdigest()[:16]


def given_games(health, pack=None) -> Iterator[str]:
    """Play 25 games from one given state and yield a digest of each."""
    chance = Chance(f"given {health}")
    bodies = [[(1, 1)] * 3, [(5, 5), (5, 4), (4, 4), (3, 4)], [(2, 5), (2, 6)], [(0, 6)]]
    snakes = [{"health": health + n, "body": [{"x": x, "y": y} for x, y in body]} for n, body in enumerate(bodies)]
    start = {"turn": 9, "board": {"height": 7, "width": 7, "food": [{"x": 3, "y": 1}], "snakes": snakes}}
    for game in range(25):
        dice = Dice(chance)
        dice.shake()
        both = Both(
            pack, dice, map_size=(7, 7), number_of_snakes=4, initial_game_state=start, observation_type="bordered-num"
        )
        both.reset(f"game {game}, reset")
        for turn in range(40):
            dice.shake()
            moves = choose(both.ours, chance, 0.1)
            both.step(moves, None, f"game {game}, turn {turn}, {moves}")
        yield both.digest.hexdigest()[:16]


def main(folder):
    """Hold ours against the original once more, and keep what it answered."""
    pack = original(folder)
    answers = {f"given {health}": list(given_games(health, pack)) for health in HEALTHS}
    for size, snakes in BOARDS:
        for observation in OBSERVATION_TYPES:
            answers[f"{size} {snakes} {observation}"] = list(games(size, snakes, observation, pack))
    lines = ",\n".join(f" {json.dumps(case)}: {json.dumps(told)}" for case, told in answers.items())
    ANSWERS.write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    main(sys.argv[1])
