"""How many positions `search` looks at in a second on one core: `python benchmarks/snake_search.py`.

Trees are grown without a guide over 32 positions of games under way between `flood_fill`s on 11×11, duels and four
players, with so many walks that no tree is full. Nothing else should run meanwhile.

    leaves       positions appraised, one a walk
    positions    turns played forward on the way to them, all walks together: the tree keeps no positions
    depth        turns a walk plays, the mean
    begin_ms     what a tree costs before its first walk
    appraise, copy, turn
                 the parts of a walk by themselves, calls a second on the same positions; a turn is played on a copy

Prints one JSON object, medians of five rounds with the smallest and the largest.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from racecraft.envs.battlesnake.board import MOVES, Board
from racecraft.envs.battlesnake.dice import StreamDice
from racecraft.envs.battlesnake.kernels.rules import apply_rules
from racecraft.envs.battlesnake.reference import Referee
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.kernels import set_threads
from racecraft.players.battlesnake.area_control import position_arrays
from racecraft.players.battlesnake.flood_fill import FloodFill
from racecraft.players.battlesnake.kernels.territory import appraise, copy_game, scratch_arrays
from racecraft.players.battlesnake.search import MOST_NODES, Tree
from racecraft.players.battlesnake.sight import safe_moves

POSITIONS = 32
ROUNDS = 5
PART_CALLS = 2000


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walks", type=int, default=2000, help="Walks of each tree.")
    asked = parser.parse_args()
    if not 1 <= asked.walks < MOST_NODES:
        parser.error(f"--walks {asked.walks}; expected 1 to {MOST_NODES - 1}, the nodes of a tree")
    set_threads(1)
    print(json.dumps({f"{snakes} snakes": measure(snakes, asked.walks) for snakes in (2, 4)}, indent=1))


def measure(snakes: int, walks: int) -> dict[str, Any]:
    """Return the figures of games of so many snakes."""
    settings = GameSettings(11, 11, snakes)
    boards = positions(settings)
    grow(boards[0], settings, walks)  # compiled, and warm
    rounds = [np.sum([grow(board, settings, walks) for board in boards], axis=0) for _ in range(ROUNDS)]
    leaves = len(boards) * walks
    figures = {
        "leaves_a_second": spread([leaves / seconds for _, seconds, _ in rounds]),
        "positions_a_second": spread([plies / seconds for _, seconds, plies in rounds]),
        "depth": round(rounds[0][2] / leaves, 2),
        "begin_ms": spread([1000 * begin / len(boards) for begin, _, _ in rounds]),
    }
    return figures | {f"{name}_a_second": spread(rates) for name, rates in parts(boards, settings).items()}


def positions(settings: GameSettings) -> list[Board]:
    """Return positions of games under way in which the first snake has a choice and nobody has left."""
    found: list[Board] = []
    player, key = FloodFill(), 0
    while len(found) < POSITIONS:
        referee, key = Referee(settings, StreamDice(key)), key + 1
        while not referee.over and len(referee.board.alive()) == settings.players and len(found) < POSITIONS:
            board = referee.board
            if board.turn % 15 == 14 and len(safe_moves(board, settings, "s0")) > 1:
                found.append(board)
            referee.turn({snake.id: player.choose(board, settings, snake.id, 1.0) for snake in board.alive()})
    return found


def grow(board: Board, settings: GameSettings, walks: int) -> tuple[float, float, int]:
    """Grow a tree; return the seconds it took to begin, those of the walks, and the turns that were played."""
    began = time.perf_counter()
    tree = Tree(board, settings, "s0")
    ready = time.perf_counter()
    tree.walk(walks)
    done = time.perf_counter()
    return ready - began, done - ready, int(tree._visits[:, tree._me].sum())  # a visit of the own snake for each turn


def parts(boards: list[Board], settings: GameSettings) -> dict[str, list[float]]:
    """Return how often in a second each part of a walk runs by itself, from Python, whose call is measured along."""
    rates: dict[str, list[float]] = {"appraise": [], "copy": [], "turn": []}
    for _ in range(ROUNDS):
        spent = dict.fromkeys(rates, 0.0)
        for board in boards[:8]:
            games, params = position_arrays(board, settings, copies=2)
            moves = np.zeros((2, settings.players), np.int64)
            moves[1] = [MOVES.index((safe_moves(board, settings, one.id) or ["up"])[0]) for one in board.alive()]
            scratch = scratch_arrays(settings.players, settings.area)

            def copy(games: Any = games) -> None:
                copy_game(0, 1, games.bodies, games.snakes, games.games, games.cells)

            def rules(games: Any = games, moves: Any = moves, params: Any = params) -> None:
                apply_rules(1, moves, games.bodies, games.snakes, games.games, games.cells, games.sides, params)

            def worth(games: Any = games, params: Any = params, scratch: Any = scratch) -> None:
                appraise(0, games.bodies, games.snakes, games.cells, params, *scratch)

            spent["copy"] += timed(copy)
            spent["turn"] += timed(lambda copy=copy, rules=rules: (copy(), rules()))
            spent["appraise"] += timed(worth)
        for name, seconds in spent.items():
            rates[name].append(8 * PART_CALLS / seconds)
    return rates


def timed(act: Callable[[], Any]) -> float:
    """Return the seconds that PART_CALLS calls take."""
    act()
    began = time.perf_counter()
    for _ in range(PART_CALLS):
        act()
    return time.perf_counter() - began


def spread(values: list[float]) -> list[float]:
    """Return the median, the smallest and the largest."""
    return [round(value, 2) if value < 100 else round(value) for value in (median(values), min(values), max(values))]


if __name__ == "__main__":
    main()
