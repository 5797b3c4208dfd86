"""The lessons' small game: the browser plays it as the referee's rules do."""

import json
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from racecraft.worlds.battlesnake import lessons
from racecraft.worlds.battlesnake.env.board import MOVES, STEPS
from racecraft.worlds.battlesnake.lessons import game

NODE = shutil.which("node")
MODULE = Path(lessons.__file__).parent / "modules/game.js"
SCRIPT = """
import { play } from "MODULE";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(play)));
"""


def wandered(rng):
    """Return moves of a snake that mostly stays on the board and seldom turns round, so that games last."""
    (x, y), moves = game.START[0], []
    for _ in range(rng.randint(1, 60)):
        steps = dict(zip(MOVES, STEPS, strict=True))
        ways = [
            one for one, (dx, dy) in steps.items()
            if 0 <= x + dx < game.SIDE and 0 <= y + dy < game.SIDE and (not moves or (-dx, -dy) != steps[moves[-1]])
        ]  # fmt: skip
        moves.append(rng.choice(ways if rng.random() < 0.97 else MOVES))
        x, y = x + steps[moves[-1]][0], y + steps[moves[-1]][1]
        if not (0 <= x < game.SIDE and 0 <= y < game.SIDE):
            break
    return moves


def told(board):
    snakes = [(one.id, [list(p) for p in one.body], one.health, one.cause, one.by) for one in board.snakes]
    return {"turn": board.turn, "food": [list(p) for p in board.food], "snakes": snakes}


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_plays_as_the_referee_does():
    rng = random.Random(4)
    games = [wandered(rng) for _ in range(1000)]
    code = SCRIPT.replace("MODULE", MODULE.as_uri())
    done = subprocess.run(
        [NODE, "--input-type=module", "-e", code], input=json.dumps(games), capture_output=True, text=True, check=True
    )
    causes = set()
    for moves, theirs in zip(games, json.loads(done.stdout), strict=True):
        ours = game.play(moves)
        keys = ("id", "body", "health", "cause", "by")
        theirs["snakes"] = [tuple(one[key] for key in keys) for one in theirs["snakes"]]
        assert told(ours) == theirs, moves
        causes |= {one.cause for one in ours.snakes}
    assert {"", "wall-collision", "snake-self-collision", "snake-collision", "head-collision"} <= causes
