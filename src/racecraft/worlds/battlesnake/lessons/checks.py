"""Checks of the lessons about snakes: they play a pupil's moves by the referee's rules, and run a pupil's code.

What needs the rules is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from racecraft.lessons.checking import Answer, AnswerError, Verdict, passed, tried
from racecraft.lessons.functions import call_function

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.board import Board

TURNS, BOARDS = 30, 500
GAMES, ENOUGH = 20, 16
"""A snake that only looks where it is safe won 23 of 40 games; so many of 20 it wins in about 3 % of tries."""
CASES = {
    "wall-collision": "wall", "snake-self-collision": "itself", "snake-collision": "body",
    "head-collision": "head", "out-of-health": "hunger",
}  # fmt: skip
STEPS = {"up": (0, 1), "down": (0, -1), "left": (-1, 0), "right": (1, 0)}


def survives(answer: Answer) -> Verdict:
    """The pupil's snake is alive after thirty turns."""
    board = _played(answer)
    you = board.snakes[0]
    if you.cause and board.turn <= TURNS:
        return tried(CASES[you.cause], turn=board.turn)
    if board.turn < TURNS:
        return tried("goes_on", turn=board.turn, health=you.health)
    return passed(turn=TURNS, length=len(you.body))


def starves(answer: Answer) -> Verdict:
    """The pupil's snake ends by hunger and by nothing else."""
    board = _played(answer)
    you = board.snakes[0]
    if you.cause == "out-of-health":
        return passed(turn=board.turn)
    return tried("other_end" if you.cause else "goes_on", turn=board.turn, health=you.health)


def wins_heads(answer: Answer) -> Verdict:
    """The other snake loses where two heads meet."""
    you, other = _played(answer).snakes
    if other.cause == "head-collision" and you.cause != other.cause:
        return passed(own=len(you.body), other=len(other.body))
    if you.cause == "head-collision":
        return tried("both" if other.cause else "shorter", own=len(you.body), other=len(other.body))
    return tried("other_end" if you.cause else "not_met", own=len(you.body), other=len(other.body))


def _played(answer: Answer) -> Board:
    from racecraft.worlds.battlesnake.lessons.game import MAX_TURNS, play

    moves = answer.taken("moves")
    if not isinstance(moves, list) or len(moves) > MAX_TURNS or not all(one in STEPS for one in map(str, moves)):
        raise AnswerError("The moves of the figure cannot be read; begin a new game in it.")
    return play([str(one) for one in moves])


def safe_move(answer: Answer) -> Verdict:
    """The pupil's `move(head, body, side)` goes into no wall and no body, wherever there is a way, on 500 boards."""
    rng = random.Random()
    boards = [one for one in (_wandered(rng) for _ in range(4 * BOARDS)) if _safe(one)][:BOARDS]
    found = call_function(answer.code("code"), "move", [[one["head"], one["body"], one["side"]] for one in boards])
    for count, (board, move) in enumerate(zip(boards, found, strict=True)):
        if move not in STEPS:
            return tried("no_move", given=str(move)[:30])
        if move not in _safe(board):
            return tried(_fault(board, move), count=count, move=move, side=board["side"], **_place(board))
    return passed(count=len(boards))


def _wandered(rng: random.Random) -> dict[str, Any]:
    """Return a snake that has walked about a board until its body was long: head, body from head to tail, side."""
    side, length = rng.randint(5, 11), rng.randint(3, 14)
    body = [[rng.randrange(side), rng.randrange(side)]]
    while len(body) < length and (ways := _safe({"head": body[0], "body": body, "side": side})):
        dx, dy = STEPS[rng.choice(ways)]
        body.insert(0, [body[0][0] + dx, body[0][1] + dy])
    return {"head": body[0], "body": body, "side": side}


def _safe(board: Mapping[str, Any]) -> list[str]:
    (x, y), side = board["head"], board["side"]
    after = {name: [x + dx, y + dy] for name, (dx, dy) in STEPS.items()}
    return [name for name, at in after.items() if all(0 <= one < side for one in at) and at not in board["body"]]


def _fault(board: Mapping[str, Any], move: str) -> str:
    at = [one + step for one, step in zip(board["head"], STEPS[move], strict=True)]
    if not all(0 <= one < board["side"] for one in at):
        return "wall"
    return "neck" if at == board["body"][1] else "body"


def _place(board: Mapping[str, Any]) -> dict[str, Any]:
    return {"x": board["head"][0], "y": board["head"][1], "length": len(board["body"])}


def beats_random(answer: Answer) -> Verdict:
    """The pupil's `move(data)` wins at least 16 of 20 games against `random_safe`, on seeds nobody saw."""
    from racecraft.worlds.battlesnake.lessons.duel import duel

    found = duel(answer.code("code"), "random_safe", GAMES)
    if found.won >= ENOUGH:
        return passed(won=found.won, games=GAMES, turns=round(found.turns / GAMES))
    if found.failed:
        return tried("fails", failed=found.failed, reason=found.reason, won=found.won, games=GAMES)
    case = "at_once" if found.turns < 20 * GAMES else "few"
    return tried(case, won=found.won, games=GAMES, enough=ENOUGH, turns=round(found.turns / GAMES))
