"""Episodes of Basic, played in the stand-in that `builtin:Basic` names. Begin with `play`.

`modules/basic.js` plays the same in the browser.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from statistics import mean

from racecraft.worlds.unity.env.basic_scene import BEHAVIOR, LARGE_GOAL, SMALL_GOAL, BasicScene
from racecraft.worlds.unity.env.player import ActionMessage

MAX_STEPS = 100
EPISODES = 1000
ACTIONS = (0, 1, 2)
"""Stay, left, right."""


@dataclass(frozen=True)
class Episode:
    """What came of some actions, up to the first end."""

    place: int
    """Where the agent stands, from 0 on the left."""
    steps: int
    total: float
    """All rewards."""
    ended: bool


def play(actions: Iterable[int]) -> Episode:
    """Return what comes of actions from the start; those behind an end are not carried out."""
    scene = BasicScene()
    scene.reset()
    place, total, steps = _seen(scene)[0], 0.0, 0
    for action in actions:
        scene.act({BEHAVIOR: [ActionMessage([], [action])]})
        place, reward, ended = _seen(scene)
        total, steps = total + reward, steps + 1
        if ended:
            return Episode(place, steps, total, ended=True)
    return Episode(place, steps, total, ended=False)


def _seen(scene: BasicScene) -> tuple[int, float, bool]:
    """Return place, reward and whether the episode ended, as the scene tells them."""
    told = scene.infos()[BEHAVIOR][0]
    return int(told.observations[0].values.argmax()), told.reward, told.done


def _at_random(rng: random.Random) -> Iterator[int]:
    while True:
        yield rng.choice(ACTIONS)


@cache
def random_episodes() -> list[tuple[str, int, float, float]]:
    """Return by end how an agent fares that knows nothing: end, episodes of 1,000, mean steps, mean return."""
    rng = random.Random(1)
    played = [play(_at_random(rng)) for _ in range(EPISODES)]
    parts = {"left": [SMALL_GOAL], "right": [LARGE_GOAL], "both": [SMALL_GOAL, LARGE_GOAL]}
    rows = {name: [one for one in played if one.place in goals] for name, goals in parts.items()}
    return [(name, len(row), mean(one.steps for one in row), mean(one.total for one in row))
            for name, row in rows.items()]  # fmt: skip
